"""What is given to `solve`, `replan` and `simulate` in the place of something else is refused by name."""

import numpy as np
import pytest
from scenes import SMALL, hand, observation

import sgnlp
from sgnlp.base.errors import InputError
from sgnlp.planning import arguments
from sgnlp.planning.ending import Ending
from sgnlp.planning.plan import Plan


class Height(sgnlp.Term):
    """A term that is not in a list."""


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"observation": np.zeros((5, 3))}, "observation is of type ndarray; sgnlp.load"),
        ({"observation": "mug.npz"}, "observation is of type str; sgnlp.load"),
        ({"settings": "robust"}, 'settings is of type str; sgnlp.preset\\("robust"\\)'),
        ({"hand": 3}, "hand is of type int; it is a name"),
        ({"formulation": "penalty"}, "formulation is of type str"),
        ({"formulation": sgnlp.Formulation}, "formulation is the class Formulation"),
        ({"solver": sgnlp.Ipopt}, "solver is the class Ipopt"),
        ({"extension": "own.py"}, "extension is of type str; sgnlp.extension"),
        ({"terms": Height()}, "terms is of type Height; it is a list"),
        ({"without_terms": "uncer"}, "without_terms is of type str"),
        ({"count": 1.0}, "count is of type float; it is a whole number"),
        ({"first": 1.5}, "first is of type float"),
        ({"obstacles": ["box.yaml"]}, r"obstacles holds a str; sgnlp.load_shapes\(file\) gives shapes"),
        ({"avoid": [()]}, "avoid holds a tuple"),
        ({"timeout": None}, "timeout is of type NoneType; it is a number of seconds"),
    ],
)
def test_an_argument_of_another_kind_is_refused_by_name_with_where_to_get_it(given, said):
    whole = {"observation": observation(), "hand": hand(), "settings": SMALL} | given
    with pytest.raises(InputError, match=said):
        sgnlp.solve(**whole)


def test_every_argument_of_solve_but_the_kernel_has_a_kind():
    names = sgnlp.solve.__annotations__.keys() - {"return", "kernel"}
    assert names == arguments.OF_SOLVE.keys()


def test_more_starts_than_a_machine_bears_are_refused_before_anything_is_made():
    with pytest.raises(InputError, match=r"count \(--starts\) must be at most 10000, not 1000000000"):
        sgnlp.solve(observation(), hand(), SMALL, count=10**9)
    assert Ending(rounds=10**12).totals(4000) == [4000, 8000]


def test_so_are_those_of_replan_and_simulate():
    plan = object.__new__(Plan)
    vars(plan)["observation"] = observation()
    with pytest.raises(InputError, match="observation is of type ndarray"):
        sgnlp.replan(plan, np.zeros((5, 3)))
    with pytest.raises(InputError, match="touches is of type Touch"):
        sgnlp.replan(plan, touches=sgnlp.Touch(np.zeros(3), np.ones(3)))
    with pytest.raises(InputError, match=r"solution is of type Plan; plan\.best is one"):
        sgnlp.simulate(plan, observation())
    with pytest.raises(InputError, match=r"settings is of type dict; sgnlp\.simulation\.SimulationSettings"):
        sgnlp.simulate(None, observation(), {"mass": 1})
    with pytest.raises(InputError, match=r"a touch is of type tuple; sgnlp\.Touch"):
        sgnlp.replan(plan, touches=[(np.zeros(3), np.ones(3))])


@pytest.mark.parametrize("values", ["a", [1j, 0, 0], [[1], [2, 3], 4], [np.nan, 0, 0], [0, 0]])
def test_a_touch_is_of_three_numbers(values):
    with pytest.raises(InputError, match="the point of a touch"):
        sgnlp.Touch(values, [0, 0, 1])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"hessian": "foo"}, "the Hessian of Ipopt is one of exact, limited-memory, not 'foo'"),
        ({"tolerance": -1}, "--solver.tolerance must be"),
        ({"tolerance": "a"}, "--solver.tolerance must be a number"),
        ({"linear_solver": "ma57"}, "unknown value of --solver.linear-solver .ma57.; valid: condensed, mumps, spral"),
    ],
)
def test_an_option_of_ipopt_is_checked_where_it_is_made(options, said):
    with pytest.raises(InputError, match=said):
        sgnlp.Ipopt(**options)
