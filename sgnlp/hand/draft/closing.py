"""The closing direction of a joint, and the directions in which the end of a finger points and closes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.draft.chains import Chain
from sgnlp.hand.draft.skeleton import Skeleton

LOPSIDED = 0.1
"""A joint with at least this |lower + upper| / (upper - lower) closes towards its larger limit; with less it is a
spreading joint. LEAP's thumb has 0.17 at its last joint, spreading joints have 0."""


@dataclass(frozen=True, eq=False)
class End:
    """The end of a finger, in the frame of its last joint. Unit vectors."""

    along: Array
    """(3,) direction in which the finger points."""
    closing: Array
    """(3,) direction in which its end moves when the last joint closes: the side of the pad."""


def sense(skeleton: Skeleton, joint: int) -> int:
    """1 if a joint closes towards its upper limit, -1 towards its lower one, 0 if its range does not decide.

    In descriptions zero is the stretched finger, and a finger bends farther inwards than outwards.
    """
    low, high = skeleton.range(joint)
    return int(np.sign(low + high)) if abs(low + high) >= LOPSIDED * (high - low) else 0


def ends(skeleton: Skeleton, chains: Sequence[Chain]) -> list[End]:
    """The end of each finger. If the range of a last joint does not decide, it closes towards the other tips'
    middle."""
    model = skeleton.model
    data = model.createData()
    pin.forwardKinematics(model, data, (model.lowerPositionLimit + model.upperPositionLimit) / 2)
    reach = [_reach(skeleton, chain) for chain in chains]
    tips = np.array([data.oMi[chain.end].act(point) for chain, point in zip(chains, reach, strict=True)])
    found = []
    for i, (chain, point) in enumerate(zip(chains, reach, strict=True)):
        axis = skeleton.axis(chain.end)
        moved = np.cross(axis, point) if skeleton.turns(chain.end) else axis
        inwards = data.oMi[chain.end].rotation.T @ (np.delete(tips, i, axis=0).mean(axis=0) - tips[i])
        way = sense(skeleton, chain.end) or np.sign(inwards @ moved) or 1
        across = point - (point @ axis) * axis if skeleton.turns(chain.end) else point - (point @ moved) * moved
        found.append(End(_unit(across, point), way * _unit(moved, axis)))
    return found


def _reach(skeleton: Skeleton, chain: Chain) -> Array:
    """The point (3,) [m] of a finger's end: the middle of its skin, or the tip's link without meshes."""
    skin = skeleton.skin(chain.end)
    model = skeleton.model
    place = model.frames[model.getFrameId(chain.tip, pin.FrameType.BODY)].placement.translation
    return skin.mean(axis=0) if len(skin) else np.array(place)


def _unit(vector: Array, otherwise: Array) -> Array:
    """The unit vector, or that of `otherwise` for a zero vector."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0 else otherwise / max(float(np.linalg.norm(otherwise)), np.finfo(float).tiny)
