"""The controller's model of the hand: tips, their Jacobian and the weight of the links, in the root link's frame.

All moving joints have a coordinate here, q_all = C q + c with the hand's own joints q. So mimic joints are folded into
those that they follow, and so are their torques, τ = Cᵀ τ_all.
"""

import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.hand.hand import Hand


class Tree:
    """The tree of the j moving joints of a hand with n own joints and m fingers.

    It holds Pinocchio's workspace, so each thread needs its own tree.
    """

    def __init__(self, hand: Hand) -> None:
        self.model = pin.buildModelFromXML(hand.description)
        """Pinocchio's model with all joints independent, in its own order: a joint comes after its parent."""
        self.coupling, self.offset = _coupling(hand, tuple(self.model.names[1:]))
        """C (j, n) and c (j,)."""
        self._tips = [_add_tip(self.model, finger.frame, finger.offset) for finger in hand.fingers]
        self._data = self.model.createData()

    def tips(self, joints: Array) -> tuple[Array, Array]:
        """Positions (m, 3) [m] of the tips at the joints (n,), and their Jacobian (3m, n)."""
        model, data = self.model, self._data
        pin.computeJointJacobians(model, data, self.coupling @ joints + self.offset)
        pin.updateFramePlacements(model, data)
        kind = pin.LOCAL_WORLD_ALIGNED  # the "world" of the model is the root link's frame
        J = np.concatenate([pin.getFrameJacobian(model, data, tip, kind)[:3] for tip in self._tips])
        return np.array([data.oMf[tip].translation for tip in self._tips]), J @ self.coupling

    def weight(self, joints: Array, gravity: Array) -> Array:
        """The torques (n,) ∂U/∂q [N m] that hold the links, with U = -Σ m g·c for masses m at c.

        `gravity` g (3,) [m/s²] is in the frame of the root link, whose own weight is not included.
        """
        self.model.gravity.linear = gravity
        torques = pin.computeGeneralizedGravity(self.model, self._data, self.coupling @ joints + self.offset)
        return np.asarray(self.coupling.T @ torques)

    @property
    def tip_frames(self) -> list[tuple[int, Array]]:
        """For each finger, the joint that moves its tip, and the tip's position (3,) [m] in that joint's frame."""
        frames = [self.model.frames[tip] for tip in self._tips]
        return [(frame.parentJoint, np.array(frame.placement.translation)) for frame in frames]


def _coupling(hand: Hand, names: tuple[str, ...]) -> tuple[Array, Array]:
    """C and c of joints by their names."""
    own = np.eye(len(hand.joint_names))
    rows = dict(zip(hand.joint_names, own, strict=True))
    rows |= {mimic.name: mimic.multiplier * own[mimic.joint] for mimic in hand.mimics}
    offsets = {mimic.name: mimic.offset for mimic in hand.mimics}
    return np.array([rows[name] for name in names]), np.array([offsets.get(name, 0.0) for name in names])


def _add_tip(model: pin.Model, link: str, offset: Array) -> int:
    """The number of a new frame at the centre of a pad."""
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    place = frame.placement * pin.SE3(np.eye(3), np.array(offset))
    return int(model.addFrame(pin.Frame(f"tip of {link}", frame.parentJoint, place, pin.FrameType.OP_FRAME)))
