"""First-order optimisers: one step by hand, their limits on simple functions, descent of the real energy."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import SMALL, hand, oracle, posed

from sgnlp.base.settings import Solver
from sgnlp.planning.planner import Planner
from sgnlp.planning.solvers.first_order import (
    DECAY,
    EPSILON,
    OPTIMISERS,
    RATES,
    Descent,
    FirstOrder,
    adamw,
    descent,
    learning_rates,
    rmsprop,
)
from sgnlp.planning.solvers.solver import NlpInstance
from sgnlp.planning.starts import starts
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.variables import UNITS

RATE = np.array([0.1, 0.02])
X, GRADIENTS = np.array([1.0, -2.0]), np.array([[0.5, -4.0], [0.25, 1.0], [-1.0, 0.0]])
STEPS = 30


@pytest.fixture(scope="module")
def begun() -> tuple[NlpInstance, np.ndarray]:
    """The penalty program and its first start."""
    problem = replace(posed(SMALL), settings=replace(SMALL, solver=Solver(compiled=False)), formulation=Penalty())
    planner = Planner(problem)
    return planner.begin(planner.stages[0], starts(problem, 1, 0)[0])


@pytest.fixture(scope="module", params=OPTIMISERS)
def found(request, begun) -> Descent:
    return descent(*begun, request.param, STEPS)


def quadratic(optimiser: str, steps: int, rate: float = 0.01) -> np.ndarray:
    """The way (steps + 1, 2) of an optimiser down x² + 25 y²."""
    curvature, way = np.array([1.0, 25.0]), [np.array([1.0, -1.0])]
    step = OPTIMISERS[optimiser](np.full(2, rate))
    for i in range(steps):
        way.append(step(i + 1, way[-1], 2 * curvature * way[-1]))
    return np.array(way)


def test_the_first_step_of_adamw_is_the_sign_of_the_gradient_and_the_decay():
    x = adamw(RATE)(1, X, GRADIENTS[0])
    np.testing.assert_allclose(x, X - RATE * (np.sign(GRADIENTS[0]) + DECAY * X), rtol=1e-6)


def test_two_steps_of_adamw_are_those_computed_by_hand():
    step = adamw(np.array([0.1]))
    first = step(1, np.array([1.0]), np.array([0.5]))
    assert first == pytest.approx(1 - 0.1 * (0.5 / (0.5 + EPSILON) + 0.01), rel=1e-14)
    m, v = 0.9 * 0.05 + 0.1 * 0.25, 0.999 * 0.00025 + 0.001 * 0.0625  # from m = 0.1 g, v = 0.001 g²
    update = (m / (1 - 0.9**2)) / (np.sqrt(v / (1 - 0.999**2)) + EPSILON) + 0.01 * first
    assert step(2, first, np.array([0.25])) == pytest.approx(first - 0.1 * update, rel=1e-14)


def test_two_steps_of_rmsprop_are_those_computed_by_hand():
    step = rmsprop(np.array([0.1]))
    first = step(1, np.array([1.0]), np.array([0.5]))
    assert first == pytest.approx(1 - 0.1 * 0.5 / (np.sqrt(0.01 * 0.25) + EPSILON), rel=1e-14)
    v = 0.99 * 0.0025 + 0.01 * 0.0625
    assert step(2, first, np.array([0.25])) == pytest.approx(first - 0.1 * 0.25 / (np.sqrt(v) + EPSILON), rel=1e-14)


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_coordinates_do_not_mix_and_keep_their_own_rates(optimiser):
    together, alone = OPTIMISERS[optimiser](RATE), [OPTIMISERS[optimiser](RATE[i : i + 1]) for i in range(2)]
    x, parts = X, [X[:1], X[1:]]
    for i, g in enumerate(GRADIENTS, 1):
        x = together(i, x, g)
        parts = [step(i, part, g[j : j + 1]) for j, (step, part) in enumerate(zip(alone, parts, strict=True))]
    np.testing.assert_array_equal(x, np.concatenate(parts))


def test_without_a_gradient_adamw_decays_and_rmsprop_stays():
    np.testing.assert_allclose(adamw(RATE)(1, X, np.zeros(2)), X * (1 - RATE * DECAY), rtol=1e-15)
    np.testing.assert_array_equal(rmsprop(RATE)(1, X, np.zeros(2)), X)


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_a_quadratic_is_descended_to_within_a_step_of_its_minimum(optimiser):
    way = quadratic(optimiser, 500)
    assert np.abs(way[-1]).max() < 0.02
    assert np.abs(way[-1]).max() < 0.02 * np.abs(way[0]).max()


def test_the_rates_are_those_of_the_release_in_scaled_units():
    nlp = oracle(SMALL, "penalty").nlp
    n, m = len(hand().joint_names), len(hand().fingers)
    physical = learning_rates(nlp.hand) * nlp.units
    blocks = np.split(physical, np.cumsum([3, 3, n, 3 * m]))
    assert [len(block) for block in blocks] == [3, 3, n, 3 * m, m]
    for name, block in zip(("linear", "angular", "joint", "target", "gain"), blocks, strict=True):
        np.testing.assert_allclose(block, RATES[name], rtol=1e-15)
        assert RATES[name] / UNITS[name] < 0.05  # a step is small beside a variable of order 1


def test_the_real_energy_is_lowered_and_the_best_on_the_way_is_kept(found, begun):
    nlp, x = begun
    assert found.energies.shape == (STEPS + 1,)
    assert found.energies[0] == pytest.approx(nlp.objective(x), rel=1e-12)
    assert found.best == found.energies.min() < found.energies[0]
    assert found.admissible >= found.best
    assert nlp.objective(found.x) == pytest.approx(found.best, rel=1e-12)


def test_every_variable_stays_within_its_bounds(found, begun):
    low, high = begun[0].x_bounds
    assert (low <= found.x).all()
    assert (found.x <= high).all()


def test_the_same_start_gives_the_same_descent(begun):
    a, b = (descent(*begun, "adamw", 5) for _ in range(2))
    np.testing.assert_array_equal(a.energies, b.energies)
    np.testing.assert_array_equal(a.x, b.x)


def test_more_steps_begin_with_the_same_ones(begun):
    longer, shorter = (descent(*begun, "rmsprop", steps).energies for steps in (6, 3))
    np.testing.assert_array_equal(longer[:4], shorter)


def test_the_answer_is_the_lowest_point_that_meets_the_rows_and_the_steps_end_with_the_programs_iterations(begun):
    nlp, x = begun
    found, answer = (
        descent(*begun, "adamw", 5),
        FirstOrder(optimiser="adamw", steps=9).solve(replace(nlp, iterations=5), x),
    )
    assert (answer.iterations, answer.lowest) == (5, found.best)
    np.testing.assert_array_equal(answer.x, found.x_admissible if np.isfinite(found.admissible) else found.x)
