"""What is measured on: clouds, hand, settings, and how often."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from sgnlp.base.settings import Settings
from sgnlp.hand.hand import Hand, load_hand
from sgnlp.perception.observation import Observation, load
from sgnlp.planning.additions import NOTHING, Additions
from sgnlp.planning.problem import Problem, build_problem
from sgnlp.program.compiled import can_compile, compile_program
from sgnlp.program.formulations.penalty import Penalty
from sgnlp.program.structure import Structure


@dataclass(frozen=True)
class Bench:
    """The subject of all measurements. What belongs to one object is measured on the first file."""

    files: tuple[Path, ...]
    hand_name: str
    preset: str
    settings: Settings
    starts: int
    seed: int
    jobs: int
    repeats: int
    objects: int = 1000

    @cached_property
    def hand(self) -> Hand:
        """The hand, loaded once."""
        return load_hand(self.hand_name, self.settings.spheres)

    @cached_property
    def observations(self) -> list[Observation]:
        """The observation of each file."""
        return [load(file) for file in self.files]

    @cached_property
    def problems(self) -> list[Problem]:
        """The problem of each file."""
        return [build_problem(observation, self.hand, self.settings, self.seed) for observation in self.observations]

    @property
    def structures(self) -> list[Structure]:
        """The structures of the phases."""
        return NOTHING.structures(self.settings)

    @property
    def compiles(self) -> bool:
        """Whether compiled functions are wanted and can be made."""
        return self.settings.solver.compiled and can_compile()

    def ready(self) -> None:
        """Compile the functions that the phases and the comparisons need, unless that is done."""
        penalty = Additions(formulation=Penalty()).structures(self.settings)
        if self.compiles:
            for needed in dict.fromkeys([*self.structures, *penalty]):
                compile_program(self.hand, needed, self.jobs)
