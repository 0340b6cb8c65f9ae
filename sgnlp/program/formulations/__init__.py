"""The formulations, one file each."""

from sgnlp.base.errors import unknown
from sgnlp.program.formulation import Formulation
from sgnlp.program.formulations.constrained import Constrained
from sgnlp.program.formulations.elastic import Elastic
from sgnlp.program.formulations.lifted import Lifted
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.formulations.two_phase import TwoPhase

FORMULATIONS: dict[str, Formulation] = {f.name: f for f in (Penalty(), Constrained(), TwoPhase(), Elastic(), Lifted())}
"""The formulations by their names in the settings."""


def formulation(name: str) -> Formulation:
    """The formulation with this name; raises `InputError` with the valid names."""
    if name not in FORMULATIONS:
        raise unknown("formulation", name, FORMULATIONS)
    return FORMULATIONS[name]
