"""What touches what, how deep and how hard."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgnlp.simulation.world import World

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Touch:
    """A contact of the object with another geom."""

    geom: int  # the other one
    point: Array  # (3,) [m]
    normal: Array  # (3,) out of the object
    force: Array  # (3,) [N] on the object


def touches(world: World, data: Any) -> Iterator[Touch]:
    """The contacts of the object that bear a force."""
    import mujoco

    for i in range(data.ncon):
        contact = data.contact[i]
        first, second = contact.geom
        if contact.efc_address < 0 or (first in world.object_geoms) == (second in world.object_geoms):
            continue
        wrench = np.zeros(6)
        mujoco.mj_contactForce(world.model, data, i, wrench)
        frame = contact.frame.reshape(3, 3)  # rows: normal from the first geom to the second, two tangents
        force = frame.T @ wrench[:3]  # on the second
        own = second in world.object_geoms
        geom = int(first if own else second)
        yield Touch(geom, contact.pos.copy(), frame[0] * (-1 if own else 1), force if own else -force)


def penetrations(world: World, data: Any) -> dict[str, float]:
    """Deepest overlap [m] of the hand with the object, the table and itself; 0 without any."""
    deepest = {"object": 0.0, "table": 0.0, "self": 0.0}
    for i in range(data.ncon):
        pair = set(data.contact[i].geom.tolist())
        if pair & world.hand_geoms:
            other = pair - world.hand_geoms
            kind = "self" if not other else "table" if world.table in other else "object"
            deepest[kind] = max(deepest[kind], -float(data.contact[i].dist))
    return deepest
