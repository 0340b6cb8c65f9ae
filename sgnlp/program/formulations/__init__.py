"""The formulations, one file each."""

from sgnlp.base.errors import unknown
from sgnlp.program.formulation import Formulation
from sgnlp.program.formulations.constrained import Constrained
from sgnlp.program.formulations.elastic import Elastic
from sgnlp.program.formulations.lifted import Lifted
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.formulations.two_phase import TwoPhase

FORMULATIONS: dict[str, Formulation] = {f.name: f for f in (Penalty(), Constrained(), TwoPhase(), Elastic(), Lifted())}
"""By the name that the settings know them by."""


def formulation(name: str) -> Formulation:
    """The formulation of a name; raises `InputError` with the valid ones."""
    if name not in FORMULATIONS:
        raise unknown("formulation", name, FORMULATIONS)
    return FORMULATIONS[name]
