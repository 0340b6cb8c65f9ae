"""The condensed factors of Ipopt's linear systems against NumPy's dense ones, and in Ipopt against MUMPS."""

import ctypes

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import SMALL, posed

from sgnlp.base import c_library
from sgnlp.planning.planner import Planner
from sgnlp.planning.solvers import kkt_factors
from sgnlp.planning.solvers.ipopt import Ipopt
from sgnlp.planning.starts import starts

SINGULAR = -5
U = 1e-8
"""Ipopt's first threshold of MA27."""


@pytest.fixture(scope="module")
def library():
    """The compiled library; without a compiler the test is left out."""
    found = kkt_factors.LIBRARY.load()
    if found is None:
        pytest.skip("no C compiler")
    return found


def integers(n):
    return np.zeros(n, np.int32)


class Factors:
    """The four functions, called as Ipopt calls them, on the entries of a symmetric matrix of size n."""

    def __init__(self, library, n, row, col, value, u=U):
        self._library, self._n, nz = library, n, len(value)
        self._options, self._tolerances, self._steps = integers(30), np.zeros(5), integers(1)
        library.ma27id_(*pointers(self._options, self._tolerances))
        self._tolerances[0] = u
        facts, keep, spare, where = (
            integers(20),
            integers(3 * n),
            integers(2 * n),
            (np.array(row) + 1, np.array(col) + 1),
        )
        entries = [n, nz, *(indices.astype(np.int32) for indices in where)]
        first = (integers(2 * (2 * nz + 3 * n + 1)), keep, spare, self._steps, 0)
        library.ma27ad_(*pointers(*entries, first[0], len(first[0]), *first[1:], *self._given, facts, np.zeros(1)))
        assert facts[0] == 0
        self._reals, self._integers = np.full(facts[4], np.nan), np.full(facts[5], -7, np.int32)
        self._reals[:nz], self._longest, told = value, integers(1), integers(20)
        arrays = (self._reals, len(self._reals), self._integers, len(self._integers))
        begun = (keep, self._steps, self._longest, integers(2 * n), *self._given)
        library.ma27bd_(*pointers(*entries, *arrays, *begun, told))
        self.flag, self.negative, self.core = told[0], told[14], self._integers[0]

    @property
    def _given(self):
        return self._options, self._tolerances

    def solve(self, b):
        """The solution for a right-hand side (n,)."""
        x, work, spare = b.copy(), np.zeros(self._longest[0]), integers(self._steps[0])
        arrays = (self._reals, len(self._reals), self._integers, len(self._integers), work, self._longest)
        self._library.ma27cd_(*pointers(self._n, *arrays, x, spare, self._steps, *self._given))
        return x


def pointers(*arguments):
    """Fortran takes everything by reference."""
    return [
        ctypes.byref(ctypes.c_int32(a)) if isinstance(a, int) else a.ctypes.data_as(ctypes.c_void_p) for a in arguments
    ]


def system(seed, n=12, equations=3, inequalities=20, spread=6.0):
    """A matrix as Ipopt has it, with barriers of the slacks over `spread` decades on both sides of 1."""
    rng = np.random.default_rng(seed)
    H = rng.normal(size=(n, n))
    C, J = rng.normal(size=(equations, n)), rng.normal(size=(inequalities, n)) * (rng.random((inequalities, n)) < 0.4)
    x, s = np.arange(n), n + np.arange(inequalities)
    c, d = s[-1] + 1 + np.arange(equations), s[-1] + 1 + equations + np.arange(inequalities)
    K = np.zeros((d[-1] + 1, d[-1] + 1))
    K[np.ix_(x, x)] = H + H.T
    K[s, s] = 10.0 ** rng.uniform(-spread, spread, inequalities)
    K[np.ix_(c, x)], K[np.ix_(d, x)], K[d, s] = C, J, -1.0
    K[c, c], K[d, d] = -1e-8, -rng.choice([0.0, 1e-8, 1.0], inequalities)
    return np.tril(K) + np.tril(K, -1).T


def factored(library, K, u=U, keep=lambda row, col: row >= col):
    row, col = np.nonzero((K != 0) | np.eye(len(K), dtype=bool))
    chosen = keep(row, col)
    return Factors(library, len(K), row[chosen], col[chosen], K[row[chosen], col[chosen]], u)


def assert_solves(found, K, tolerance=1e-9):
    """The solution has a small residual, and after one refinement as Ipopt makes it, one that rounding explains.

    The negative eigenvalues are as many as NumPy finds. A refinement alone would hide a wrong solution of the slacks.
    """
    b = np.random.default_rng(len(K)).normal(size=len(K))
    x = found.solve(b)
    np.testing.assert_allclose(K @ x, b, atol=1e4 * tolerance * (1 + np.abs(x).max()))
    x += found.solve(b - K @ x)
    assert found.flag == 0
    np.testing.assert_allclose(K @ x, b, atol=tolerance * (1 + np.abs(x).max()))
    scale = 1 / np.sqrt(np.maximum(np.abs(K).max(axis=1), 1e-300))
    assert found.negative == (np.linalg.eigvalsh(scale[:, None] * K * scale) < 0).sum()


@given(st.integers(0, 10_000), st.sampled_from([1e-8, 1e-4, 0.5]))
def test_a_system_of_ipopt_is_solved_and_its_negative_eigenvalues_are_counted(library, seed, u):
    K = system(seed)
    assert_solves(factored(library, K, u), K)


@pytest.mark.parametrize("half", [lambda row, col: row >= col, lambda row, col: row <= col])
def test_either_triangle_may_be_given(library, half):
    K = system(1)
    assert_solves(factored(library, K, keep=half), K)


def test_what_is_left_are_variables_and_equations(library):
    assert factored(library, system(2, spread=3.0)).core == 12 + 3


def test_a_row_stays_whose_pivot_is_below_the_threshold(library):
    K = system(3, spread=0.0)
    slack = 12 + 4
    K[slack, slack] = 1e6
    K[-16, -16] = 0.0  # the row of that slack
    assert np.nonzero(K[slack])[0].tolist() == [slack, len(K) - 16]
    assert factored(library, K, u=1e-5).core == 12 + 3 + 1
    assert factored(library, K, u=1e-8).core == 12 + 3
    for u in (1e-5, 1e-8):
        assert_solves(factored(library, K, u), K)


def with_a_barrier(barrier, delta=0.0):
    """The first slack has this barrier, and its row this diagonal."""
    K = system(4, spread=1.0)
    K[12, 12], K[-20, -20] = barrier, -delta
    return K


@pytest.mark.parametrize("delta", [0.0, 1.0])
@pytest.mark.parametrize("barrier", [0.0, 1e-300, 1e-30, 1e4, -2.0])
def test_a_slack_with_any_barrier_is_solved(library, barrier, delta):
    K = with_a_barrier(barrier, delta)
    assert_solves(factored(library, K), K)


def test_a_slack_that_cannot_move_makes_no_number_infinite(library):
    found = factored(library, with_a_barrier(1e300))
    assert np.isfinite(found.solve(np.ones(12 + 20 + 3 + 20))).all()


@pytest.mark.parametrize("n", [1, 2, 5, 30])
def test_any_symmetric_matrix_is_solved(library, n):
    A = np.random.default_rng(n).normal(size=(n, n))
    K = A + A.T
    assert_solves(factored(library, K), K)


def test_a_matrix_with_a_zero_diagonal_needs_blocks_of_two(library):
    A = np.random.default_rng(7).normal(size=(8, 8))
    K = A + A.T - np.diag(2 * np.diag(A))
    assert_solves(factored(library, K), K)


def elastic(seed, inequalities=20):
    """A system in which each row of an inequality has three slacks with barriers, one of them large."""
    K = system(seed, spread=2.0)
    n, rng = len(K), np.random.default_rng(seed)
    whole = np.zeros((n + 2 * inequalities,) * 2)
    whole[:n, :n] = K
    for row in range(inequalities):
        for sign in (0, 1):
            slack = n + 2 * row + sign
            whole[slack, slack] = 10.0 ** rng.uniform(-1.0, 8.0)
            whole[slack, n - inequalities + row] = whole[n - inequalities + row, slack] = 1.0 - 2.0 * sign
    return whole


@pytest.mark.parametrize("u", [1e-8, 0.5])
@pytest.mark.parametrize("seed", range(5))
def test_rows_with_several_slacks_are_solved_and_go(library, seed, u):
    K = elastic(seed)
    found = factored(library, K, u)
    assert_solves(found, K)
    assert found.core <= 12 + 3 + 20
    assert u == 0.5 or found.core == 12 + 3


@pytest.mark.parametrize("barrier", [0.0, -2.0])
def test_a_row_with_several_slacks_is_solved_whatever_the_barrier_of_one(library, barrier):
    K = elastic(1)
    K[12, 12] = barrier
    assert_solves(factored(library, K), K)


def test_rows_with_slacks_that_meet_each_other_are_solved(library):
    K = system(5, spread=1.0)
    for i, j in ((1, 2), (2, 3), (5, 9)):
        K[-i, -j] = K[-j, -i] = 0.7
    assert_solves(factored(library, K), K)


def test_entries_that_stand_twice_add_up(library):
    K = system(6, spread=2.0)
    row, col = np.nonzero(np.tril(K))
    value = K[row, col]
    part = np.random.default_rng(0).uniform(0.2, 0.8, len(value))
    off = (row >= len(K) - 20) & (col < 12)  # entries of the inequalities' rows, also out of order
    rows, cols = np.concatenate([row, row[off][::-1]]), np.concatenate([col, col[off][::-1]])
    values = np.concatenate([np.where(off, part * value, value), ((1 - part) * value)[off][::-1]])
    assert_solves(Factors(library, len(K), rows, cols, values), K)


@pytest.mark.parametrize("place", [0, 5])
def test_a_singular_matrix_is_told(library, place):
    K = system(8, spread=1.0)
    K[place] = K[:, place] = 0.0
    assert factored(library, K).flag == SINGULAR


def test_numbers_that_are_not_finite_end_without_harm(library):
    K = system(9, spread=1.0)
    K[3, 3] = np.nan
    found = factored(library, K)
    assert found.flag == SINGULAR or not np.isfinite(found.solve(np.ones(len(K)))).all()


def test_ipopt_takes_the_same_steps_as_with_mumps(library):
    x = ca.SX.sym("x", 6)
    rows = ca.vertcat(x[:3] * x[3:] - 0.3, ca.sumsqr(x), x[0] + x[5])
    problem = {"x": x, "f": ca.sumsqr(x - ca.DM(range(6))) + ca.sin(3 * x[1]), "g": rows}
    bounds = {"lbg": [0, -1, -1, -1, 0.4], "ubg": [1, 1, 1, 4, 0.4], "x0": 0.1}
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-9}
    ends = []
    for options in (kkt_factors.options(), {"ipopt.linear_solver": "mumps"}):
        solver = ca.nlpsol("s", "ipopt", problem, quiet | options)
        end = solver(**bounds)
        ends.append(np.array(end["x"]).ravel())
        assert solver.stats()["success"]
        ends[-1] = np.append(ends[-1], solver.stats()["iter_count"])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)


def test_a_grasp_is_that_of_mumps(library):
    problem = posed(SMALL)
    start = starts(problem, 1, 0)[0]
    condensed, mumps = (Planner(problem, Ipopt(linear_solver=name)).solve(start) for name in ("condensed", "mumps"))
    assert condensed.kkt.worst < 1e-5
    assert condensed.objective == pytest.approx(mumps.objective, rel=1e-5)


def test_without_a_compiler_mumps_takes_its_place_and_the_record_says_so(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    c_library.attempt.cache_clear()
    monkeypatch.setattr("sgnlp.base.toolchain.note_of", lambda library: None)
    try:
        assert kkt_factors.options() == {}
        assert Ipopt().backends()["linear_systems"].startswith("MUMPS (no C compiler")
        problem = posed(SMALL)
        planner = Planner(problem, Ipopt())
        instance, _ = planner.begin(planner.stages[0], starts(problem, 1, 0)[0])
        assert planner.solver.options(instance)["ipopt.linear_solver"] == "mumps"
    finally:
        c_library.attempt.cache_clear()


def test_other_linear_solvers_are_recorded_by_their_name_alone():
    assert Ipopt(linear_solver="mumps").backends() == {}
    assert (Ipopt().name, Ipopt(linear_solver="mumps").name) == ("ipopt", "ipopt-mumps")
