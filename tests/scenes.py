"""Small seeded scenes shared by the tests: bodies on a table, a posed problem, random points near its starts."""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from sgnlp.base.presets import ROBUST, preset
from sgnlp.base.settings import Closing, Settings
from sgnlp.base.surface_settings import GpisSettings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation, observe
from sgnlp.perception.shape import Shape
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.planning.recompute import recompute
from sgnlp.planning.starts import Start, at_contact, initial, starts
from sgnlp.planning.surroundings import NOWHERE, Surroundings
from sgnlp.program.compiled import program
from sgnlp.program.constraints import preset_constraints
from sgnlp.program.formulations import formulation
from sgnlp.program.grasp import Grasp
from sgnlp.program.nlp import FUNCTIONS, Nlp, frame
from sgnlp.program.oracle import Oracle, join
from sgnlp.program.parameters import ParameterVector
from sgnlp.program.terms import preset_terms
from sgnlp.program.variables import AtContact, Posture, posture, variable_units
from sgnlp.surface.gpis import Gpis, fit
from sgnlp.surface.kernel import Kernel
from sgnlp.surface.kernels import ThinPlate
from sgnlp.surface.training import training_set

Array = NDArray[np.float64]

SEMI_AXES = np.array([0.035, 0.05, 0.04])  # [m]
SMALL = replace(
    preset("robust+uncertainty"),
    gpis=GpisSettings(surface_points=60, interior_points=15),
    contact=replace(ROBUST.contact, mass=0.0, samples=4),
    closing=Closing(),
    limits=replace(ROBUST.limits, place_error=0.0, effort=0.0, rotation_deg=10.0, shift=0.01, give=0.0),
)
"""The robust settings with every term, fewer points and samples, without weight, so that forces balance, of the
pregrasp alone, and with room for a motion to the equilibrium."""
REACHING = replace(
    SMALL, closing=Closing(planned=True, c_freedom=0.2), limits=replace(SMALL.limits, effort=1.0, place_error=0.004)
)
"""The same with the hand at first contact planned: its joints, and c of each finger."""

CROWD = Surroundings(
    obstacles=(
        Shape.box([0.1, 0.02, 0.05], [0.06, 0.2, 0.1], name="crate"),
        Shape.sphere([-0.05, 0.12, 0.1], 0.05),
        Shape.cylinder([0.0, -0.12, 0.1], 0.03, 0.2),
    ),
    avoid=(Shape.box([0.03, 0.0, 0.05], [0.03, 0.1, 0.1], name="handle"),),
    touch=(Shape.half_space([0.0, 0.0, 0.07], [0.0, 0.0, 1.0]), Shape.sphere([0.0, 0.0, 0.04], 0.03)),
)
"""Obstacles on three sides of the ellipsoid, a part of it to stay off, and one to touch."""


def sphere_points(count: int, seed: int) -> Array:
    """Points (count, 3) spread evenly at random over the unit sphere."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def ellipsoid(count: int = 1500, seed: int = 0) -> Array:
    """Points (n, 3) [m] of an ellipsoid on the table z = 0, without its underside."""
    points = sphere_points(count, seed) * SEMI_AXES + [0.0, 0.0, SEMI_AXES[2]]
    return points[points[:, 2] > 0.005]


@lru_cache
def observation() -> Observation:
    """The ellipsoid seen from all sides but below."""
    return observe(ellipsoid(), table_height=0.0, name="ellipsoid")


@lru_cache
def surface(kernel: type[Kernel] = ThinPlate, count: int = 60) -> Gpis:
    """The ellipsoid's implicit surface."""
    settings = GpisSettings(surface_points=count, interior_points=count // 4)
    return fit(training_set(observation(), settings, 0, kernel))


def hand(spheres: str = "cover") -> Hand:
    """The left Allegro hand, loaded once so that what is built for it is built once."""
    return _loaded(spheres)


_loaded = lru_cache(partial(load_hand, "allegro_left"))


@lru_cache
def posed(settings: Settings, around: Surroundings = NOWHERE, arm: str | None = None) -> Problem:
    """The problem of grasping the ellipsoid, by a hand on a free wrist or on an arm."""
    robot = load_hand("allegro_left", settings.spheres, arm) if arm else hand(settings.spheres)
    return build_problem(observation(), robot, settings, surroundings=around)


def impossible(settings: Settings) -> Settings:
    """Settings that no grasp meets: a hand far above its object. A solver is not to search for long."""
    limits = replace(settings.limits, table_margin=0.5)
    return replace(settings, limits=limits, solver=replace(settings.solver, penalty_iterations=2, max_iterations=5))


def with_settings(problem: Problem, settings: Settings) -> Problem:
    """The same hand and surface with other settings."""
    terms, constraints = preset_terms(settings), preset_constraints(settings)
    return replace(problem, settings=settings, terms=terms, constraints=constraints)


@lru_cache
def oracle(settings: Settings, name: str, around: Surroundings = NOWHERE, arm: str | None = None) -> Oracle:
    """The functions of `posed(settings)` in a formulation."""
    problem = posed(settings, around, arm)
    return join(built(problem, name), problem.gpis, fields=problem.fields)


def built(problem: Problem, name: str) -> Nlp:
    """The program of a problem in a formulation, interpreted; built once for all settings of the same structure."""
    return _program(problem.hand, problem.structure(formulation(name)))


_program = lru_cache(maxsize=None)(partial(program, compiled=False))


def random_point(problem: Problem, nlp: Nlp, seed: int, spread: float = 0.05) -> tuple[Start, Array]:
    """A start and scaled variables near it, those that every formulation has, inside their bounds."""
    rng = np.random.default_rng(seed)
    start = starts(problem, len(problem.hand.wrist_starts), 0)[rng.integers(len(problem.hand.wrist_starts))]
    x = initial(nlp, start)
    x += spread * rng.normal(size=len(x))
    low, high = (bound[: len(x)] for bound in problem.variable_bounds(nlp, start.joints))
    return start, np.clip(x, low + spread / 10, high - spread / 10)


def with_added(functions: Oracle, x: Array, p: Array, g_bounds: tuple[Array, Array]) -> Array:
    """Scaled variables that every program has, with those that the oracle's formulation adds."""
    shared = x[: len(variable_units(functions.nlp.hand))]
    before = np.concatenate([shared, at_contact(functions.nlp, shared, p)])
    return np.concatenate([before, functions.nlp.structure.formulation.begin(functions, before, p, g_bounds)])


def random_rotation(rng: np.random.Generator) -> Array:
    """A rotation matrix (3, 3), uniform over all of them."""
    q = rng.normal(size=4)
    x, y, z, w = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def exact_grasp(problem: Problem, start: Start, x: Array) -> Grasp:
    """The grasp that scaled variables x stand for, recomputed in NumPy."""
    return recompute(problem, pregrasp(problem, start, x))[0]


def pregrasp(problem: Problem, start: Start, x: Array) -> Posture:
    """What scaled variables x stand for: those of every program, or with what the constrained one adds."""
    whole = len(x) > len(variable_units(problem.hand))
    at = problem.structure(formulation("constrained")).at_contact if whole else AtContact()
    return posture(problem.hand, at, (start.wrist, start.joints), x, problem.settings.contact.c)


def random_grasp(settings: Settings, seed: int) -> Grasp:
    """The NumPy grasp at a random point near a start. No symbolic function is built for it."""
    problem = posed(settings)
    return exact_grasp(problem, *random_point(problem, unbuilt(problem), seed))


def unbuilt(problem: Problem) -> Nlp:
    """The penalty program of a problem without its functions: what its variables and parameters need."""
    structure = problem.structure(formulation("penalty"))
    return Nlp(**frame(problem.hand, structure, [1] * len(structure.rows)), **dict.fromkeys(FUNCTIONS))


def block(parameters: ParameterVector, name: str) -> slice:
    """Where a named block lies in the parameter vector."""
    names, sizes = list(parameters.sizes), list(parameters.sizes.values())
    low = sum(sizes[: names.index(name)])
    return slice(low, low + parameters.sizes[name])
