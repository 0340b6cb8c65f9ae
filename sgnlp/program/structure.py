"""What the symbolic functions of a program depend on: they are built and compiled once for each structure."""

from dataclasses import dataclass, replace

from sgnlp.base.errors import InputError
from sgnlp.base.settings import Settings


@dataclass(frozen=True)
class Structure:
    """All that the symbolic functions depend on, beside the hand."""

    formulation: str
    samples: int
    density: str
    equilibrium: str
    metric: str = "spring"
    heuristic: bool = False
    torques: bool = False

    @property
    def lifted(self) -> bool:
        """Whether tips and the pose at equilibrium are variables."""
        return self.formulation == "lifted"

    @property
    def traits(self) -> tuple[str, ...]:
        """What constraints may need: formulation, metric, gains that follow from the surface, limits of torques."""
        there = {
            "heuristic": self.heuristic,
            "torques": self.torques,
            "torques_eq": self.torques and self.metric == "spring",
        }
        return (self.formulation, self.metric, *(name for name, yes in there.items() if yes))

    @property
    def rigid(self) -> "Structure":
        """The structure whose functions an elastic program wraps: its own but for the formulation."""
        return replace(self, formulation="constrained") if self.formulation == "elastic" else self


def structure(settings: Settings, formulation: str) -> Structure:
    """The structure of a formulation: `penalty`, `constrained`, `elastic` or `lifted`.

    Raises `InputError` if the formulation cannot say what the settings ask for.
    """
    contact = settings.contact
    if formulation == "lifted" and (contact.metric, contact.equilibrium) != ("spring", "exact"):
        needs = "needs --contact.metric spring and --contact.equilibrium exact"
        raise InputError(f"--solver.formulation lifted {needs}, not {contact.metric} and {contact.equilibrium}")
    return Structure(
        formulation=formulation,
        samples=contact.samples,
        density=contact.density,
        equilibrium=contact.equilibrium,
        metric=contact.metric,
        heuristic=contact.heuristic > 0,
        torques=settings.limits.effort > 0 and formulation != "penalty",
    )
