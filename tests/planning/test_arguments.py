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
        ({"timeout": None}, "timeout is of type NoneType; it is a number of seconds"),
    ],
)
def test_an_argument_of_another_kind_is_refused_by_name_with_where_to_get_it(given, said):
    whole = {"observation": observation(), "hand": hand(), "settings": SMALL} | given
    with pytest.raises(InputError, match=said):
        sgnlp.solve(**whole)


def test_every_argument_of_solve_but_functions_has_a_kind():
    names = sgnlp.solve.__annotations__.keys() - {"return", "kernel", "progress"}
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
