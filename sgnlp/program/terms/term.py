"""The interface of an energy term."""

import inspect
from dataclasses import dataclass
from typing import Any, ClassVar

from sgnlp.program.grasp import Grasp
from sgnlp.program.ops import Ops


@dataclass(frozen=True)
class Term:
    """A term of the energy E = Σ weight · value(g), written once for CasADi and NumPy.

    Your own term is a subclass with a `value`; its name is that of the class in lower case, unless the class has a
    `name`. `setting` is the field of `settings.Weights` with the weight of a built-in term. `constrained_elsewhere`
    marks a term that a constraint replaces in the constrained formulation, `of_arm` one that needs `g.arm`.
    """

    weight: float = 1.0

    name: ClassVar[str] = ""
    setting: ClassVar[str] = ""
    about: ClassVar[str] = ""
    """What it rewards, in a few words; by default the first line of the docstring."""
    constrained_elsewhere: ClassVar[bool] = False
    of_arm: ClassVar[bool] = False
    """Whether it needs the arm; the first of two phases has no arm and leaves it out."""
    source: ClassVar[str] = ""
    """Hash of the file that a term was loaded from; part of the key of compiled functions."""

    def __init_subclass__(cls) -> None:
        """Name the term after its class, unless it says otherwise."""
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__.lower()
        if "about" not in cls.__dict__:
            cls.about = next(iter((inspect.getdoc(cls) or "").splitlines()), "")

    def value(self, g: Grasp, op: Ops) -> Any:
        """The term at a grasp, unweighted: a CasADi scalar or a number, in the operations `op`."""
        raise NotImplementedError
