"""`sgnlp doctor`: what runs on this machine, and what it lacks."""

import shlex
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from sgnlp.base import semaphores, toolchain
from sgnlp.base.compilers import CPP, C
from sgnlp.hand import placement_functions
from sgnlp.planning import environment
from sgnlp.planning.solvers import kkt_factors
from sgnlp.show import tables
from sgnlp.surface import native


@dataclass
class Doctor:
    """Show versions, solvers, how functions are evaluated, what this machine lacks, and how to install it."""

    def run(self, console: Console) -> int:
        """One block a question."""
        facts: dict[str, Any] = {
            "machine": environment.machine(),
            "versions": environment.versions(),
            "solvers": {name: "found" if found else "missing" for name, found in environment.solvers().items()},
            "evaluated by": {
                "forward kinematics": environment.kinematics_backends(),
                "surface": "NumPy" if native.LIBRARY.load() is None else "compiled C",
                "linear systems": "MUMPS" if kkt_factors.LIBRARY.load() is None else "compiled C",
            },
        }
        for title, rows in facts.items():
            console.print(tables.facts_table(title, rows))
        for name, told in _machine().items():
            console.print(f"{name}: {told}", soft_wrap=True)
        return 0


def _machine() -> dict[str, str]:
    """What compilers and worker processes need: where it is, or what is wrong and how to fix it."""
    fault = C.fault() or toolchain.cache_fault() or native.LIBRARY.fault()
    passed = toolchain.passed_over()
    facts = {
        "C compiler": C.fault() or shlex.join(C.words() or ()),
        "C++ compiler": CPP.fault() or shlex.join(CPP.words() or ()),
        "cache": toolchain.cache_fault() or f"{toolchain.cache_folder()}{f' ({passed})' if passed else ''}",
        "worker processes": semaphores.fault() or "as many as --jobs asks for",
    }
    facts |= {f"kinematics by {using}": lack or "runs" for using, lack in environment.kinematics_lacks().items()}
    own = placement_functions.fault() or "sgnlp cache --build --hand FOLDER compiles Pinocchio's"
    facts["kinematics of a hand of your own"] = own
    return facts | ({"surface in NumPy": fault} if native.LIBRARY.load() is None else {})
