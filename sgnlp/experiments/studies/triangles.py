"""The triangle study: can a hand grasp more poses within its torque limits if the object may move?

The paper's experiment in the plane: two triangles, three sets of contacts, 100 poses each. It counts the poses that
have a feasible compliant grasp, and those of them that have a grasp in force closure without any motion, under the same
limit. From the paper: contacts, vertices, and one result, direct force closure in about 85 % of the feasible poses.
From its release: three fingers of two links of 0.7 m, μ = 0.5, 5 N, poses within ±0.5 m and ±45° whose contacts all
fingers reach, and the limit 12. The release puts that limit on J⁻¹f, which is no torque; the torque is Jᵀf. Both are
measured here. Neither says the rest, which is chosen here: fingers do not cross, elbows point outwards, 5 N act along
the normal, gains are at most 200 N/m, motions are straight, and the limit is kept all along them.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice, product
from math import inf

import numpy as np

from sgnlp.base.arrays import Array
from sgnlp.experiments.frames import Frame, Tables, curves, percent
from sgnlp.experiments.studies.planar import Demands, Finger, Stage, holds, least_torque, turn
from sgnlp.experiments.studies.study import Case, Setup, Study
from sgnlp.perception.observation import Observation
from sgnlp.show.plots import Panel

TRIANGLES = {"1": ((0, 0), (1, 0), (0.5, 1)), "2": ((0, 0), (1, 0), (1, 1))}
"""Vertices, counter-clockwise [m]; the paper draws them, and its contacts lie on them."""
CONTACTS = {
    ("1", "1"): ((0.5, 0.0), (0.75, 0.5), (0.25, 0.5)),
    ("1", "2"): ((0.4, 0.0), (0.8, 0.4), (0.2, 0.4)),
    ("1", "3"): ((0.6, 0.0), (0.7, 0.6), (0.3, 0.6)),
    ("2", "1"): ((0.5, 0.0), (1.0, 0.5), (0.5, 0.5)),
    ("2", "2"): ((0.4, 0.0), (1.0, 0.4), (0.4, 0.4)),
    ("2", "3"): ((0.6, 0.0), (1.0, 0.6), (0.6, 0.6)),
}
"""By triangle and configuration (paper, table of contacts), one on each edge [m]."""
LINKS = (0.7, 0.7)
FINGERS = (Finger((0.5, -1.0), LINKS, 1), Finger((1.0, 1.0), LINKS, -1), Finger((0.0, 1.0), LINKS, 1))
POSES = 100
WITHIN, TURNED = 0.5, np.pi / 4  # poses are drawn within ± this [m], [rad] (release)
DEMANDS = Demands(friction=0.5, force=5.0, gains=(5.0, 200.0), stiffness=0.1)
FARTHEST = np.array([0.3, 0.3, np.radians(30)])
"""Largest motions: of the contacts' centroid along x and y [m], and of the object about it [rad], each way."""
HALVINGS = 2
"""Number of halvings of the search's steps, down to 75 mm and 7.5°."""
STAGES = 5
"""Number of poses on the way, with both ends, at which cones and limit hold."""
LIMITS = {"Jᵀf": (2.5, 3.0, 3.5, 4.0, 5.0, 7.0, 12.0), "J⁻¹f": (12.0,)}
"""Limits [N m], and [N/m] of the release's quantity."""
SHOWN = {"Jᵀf": 3.5, "J⁻¹f": 12.0}
"""The limit of the table by configuration: half of 5 N times the reach of 1.4 m, and that of the release."""
PAPER = "about 85"


@dataclass(frozen=True)
class Row:
    """A pose, and the least limit with which it has a grasp: directly, or with the motion; inf if with none."""

    triangle: str
    configuration: str
    pose: int
    x: float
    y: float
    angle_deg: float
    direct: float
    compliant: float
    direct_inverse: float
    compliant_inverse: float


def edge_normals(triangle: str) -> Array:
    """Outward normals (3, 2) of the edges."""
    vertices = np.array(TRIANGLES[triangle], dtype=float)
    edges = np.roll(vertices, -1, axis=0) - vertices
    return np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)


def stage(points: Array, normals: Array) -> Stage | None:
    """Contacts with the Jᵀ of each finger; None where a finger does not reach."""
    reached = [m for finger, tip in zip(FINGERS, points, strict=True) if (m := finger.torques(tip)) is not None]
    return Stage(points, normals, np.stack(reached)) if len(reached) == len(FINGERS) else None


def way(points: Array, normals: Array, motion: Array) -> list[Stage] | None:
    """The stages of a motion (x, y, angle); None where a finger does not reach one of them."""
    centre = points.mean(axis=0)
    stages = []
    for beta in np.linspace(0, 1, STAGES) if motion.any() else (0.0,):
        R = turn(beta * motion[2])
        there = stage((points - centre) @ R.T + centre + beta * motion[:2], normals @ R.T)
        if there is None:
            return None
        stages.append(there)
    return stages


def inverted(there: Stage) -> Stage:
    """The stage with J⁻¹ in the place of Jᵀ, as in the release."""
    return replace(there, torques=np.linalg.inv(np.swapaxes(there.torques, 1, 2)).astype(float))


def poses(seed: int, triangle: str, configuration: str) -> Iterator[tuple[float, float, float]]:
    """An endless sequence of random poses (x, y, angle) whose contacts the fingers reach."""
    rng = np.random.default_rng([seed, int(triangle), int(configuration)])
    contacts = np.array(CONTACTS[triangle, configuration])
    while True:
        x, y, angle = rng.uniform(-1, 1, 3) * (WITHIN, WITHIN, TURNED)
        if stage(contacts @ turn(angle).T + (x, y), edge_normals(triangle)) is not None:
            yield x, y, angle


def least_limit(stages: Sequence[Stage] | None) -> float:
    """The least limit under which a way has a grasp, inf if under none."""
    grasp = least_torque(stages, DEMANDS) if stages else None
    return grasp.torque if stages and grasp is not None and holds(grasp, stages, DEMANDS) else inf


def search(value: Callable[[Array], float]) -> tuple[float, float]:
    """The value without motion, and the least value found.

    It tries the largest motions each way and their combinations, then a compass search from the best (Kolda et al.
    2003).
    """
    values = {step: value(FARTHEST * step) for step in product((0.0, -1.0, 1.0), repeat=3)}
    best = min(values, key=values.__getitem__)
    for size in 0.5 ** np.arange(1, HALVINGS + 1):
        while True:
            around = [tuple(best + sign * size * axis) for axis in np.eye(3) for sign in (-1, 1)]
            inside = [step for step in around if max(map(abs, step)) <= 1]
            values |= {step: value(FARTHEST * step) for step in inside if step not in values}
            nearest = min(inside, key=values.__getitem__)
            if values[nearest] >= values[best]:
                break
            best = nearest
    return values[0.0, 0.0, 0.0], values[best]


def rows_of(seed: int, triangle: str, configuration: str, pose: int) -> list[Row]:
    """The row of a pose."""
    x, y, angle = next(islice(poses(seed, triangle, configuration), pose, None))
    points = np.array(CONTACTS[triangle, configuration]) @ turn(angle).T + (x, y)
    normals = edge_normals(triangle) @ turn(angle).T

    def released(motion: Array) -> float:
        stages = way(points, normals, motion)
        return least_limit(stages and [inverted(there) for there in stages])

    torque = search(lambda motion: least_limit(way(points, normals, motion)))
    numbers = (x, y, np.degrees(angle), *torque, *search(released))
    return [Row(triangle, configuration, pose, *(round(float(number), 6) for number in numbers))]


def cases(setup: Setup, observations: Sequence[Observation]) -> list[Case]:
    """A case for each pose."""
    every = product(CONTACTS, range(POSES))
    return [Case((*key, str(pose)), partial(rows_of, setup.seed, *key, pose)) for key, pose in every]


def counts(rows: Frame, quantity: str, limit: float) -> tuple[int, int]:
    """Poses with a compliant grasp under a limit, and those with a direct one."""
    suffix = "" if quantity == "Jᵀf" else "_inverse"
    return (rows[f"compliant{suffix}"] <= limit).sum(), (rows[f"direct{suffix}"] <= limit).sum()


def configurations(rows: Frame) -> dict[tuple[str, str], Frame]:
    """The poses of each triangle and set of contacts, none if there are no rows of them."""
    return {key: rows[(rows.triangle == key[0]) & (rows.configuration == key[1])] for key in CONTACTS}


def tables(rows: Frame) -> Tables:
    """By limit over all poses, and by configuration at one limit."""
    by_limit = [
        {"limit on": quantity, "limit [N m]": f"{limit:g}"} | _counted(rows, quantity, limit)
        for quantity, limits in LIMITS.items()
        for limit in limits
    ]
    by_configuration = [
        {"limit on": f"{quantity} ≤ {limit:g}", "triangle": triangle, "configuration": configuration}
        | _counted(found, quantity, limit)
        for quantity, limit in SHOWN.items()
        for (triangle, configuration), found in configurations(rows).items()
    ]
    return {"Grasps by limit": by_limit, "Grasps by configuration": by_configuration}


def _counted(rows: Frame, quantity: str, limit: float) -> dict[str, str]:
    compliant, direct = counts(rows, quantity, limit)
    numbers = {"poses": len(rows), "compliant": compliant, "direct": direct}
    share = {"direct of compliant [%] (95 %)": percent(direct, compliant), "paper [%]": PAPER}
    return {name: str(number) for name, number in numbers.items()} | share


def panels(rows: Frame) -> list[Panel]:
    """Share of poses that have a grasp over the limit, for each configuration."""
    from pandas import DataFrame

    shown, limits = [], np.linspace(0, 8, 161)
    for (triangle, configuration), found in configurations(rows).items():
        if len(found):
            poses = DataFrame([counts(found, "Jᵀf", limit) for limit in limits], limits, ["compliant", "direct"])
            title = f"triangle {triangle}, configuration {configuration}"
            series = curves(100 * poses / len(found), look="line")
            shown.append(Panel(title, "limit of the joint torques [N m]", "poses [%]", series))
    return shown


STUDY = Study(
    question="does letting the object move get around the limits of the joint torques?",
    row=Row,
    cases=cases,
    tables=tables,
    panels=panels,
    caption=(
        "Share of the poses with a compliant grasp, and of those in force closure without any motion, over the "
        "limit of the joint torques."
    ),
    facts=lambda setup: {"seed": setup.seed, "poses": POSES},
    clouds=False,
)
