"""The environment: versions, machine, backends of the kinematics, and solvers."""

import importlib.metadata
import platform
import subprocess
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

import casadi as ca
import pinocchio as pin

from sgnlp.base.errors import InputError
from sgnlp.base.toolchain import processor
from sgnlp.hand.arm import available_arms, load_arm
from sgnlp.hand.hand import available_hands, load_hand
from sgnlp.hand.placements import BACKENDS, backend, lack
from sgnlp.surface.native import LIBRARY

PACKAGES = ("sgnlp", "casadi", "pin", "example-robot-data", "numpy", "scipy", "open3d", "mujoco", "coacd")
CODE = ("sgnlp", "urdf", "problems")
"""Folders of the checkout on which results depend."""


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result depends on; "missing" if one is not installed."""
    return {"python": platform.python_version()} | {package: _version(package) for package in PACKAGES}


@cache
def _version(package: str) -> str:
    """The version of an installed package, read once from its files, which takes milliseconds."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "missing"


def commit(checkout: Path | None = None) -> str:
    """The commit of a checkout, with "+ changes" if its files differ from it; "none" if there is no repository.

    Without an argument it is the commit of the running code.
    """
    git = partial(_git, checkout or Path(__file__).parents[2])
    try:
        return git("rev-parse", "HEAD") + (" + changes" if git("status", "--porcelain", "-uno", "--", *CODE) else "")
    except (OSError, subprocess.CalledProcessError):
        return "none"


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=True, encoding="utf-8")
    return done.stdout.strip()


def machine() -> dict[str, Any]:
    """Operating system and processor."""
    return {"system": platform.system(), "processor": _processor(), "release": platform.release()}


def solvers() -> dict[str, bool]:
    """Nonlinear and linear solvers of CasADi, and whether each can be loaded here."""
    linear = {f"linsol {name}": ca.has_linsol(name) for name in ("mumps", "ma27", "qr")}
    return {f"nlpsol {name}": ca.has_nlpsol(name) for name in ("ipopt", "sqpmethod", "fatrop", "uno")} | linear


def surface_backend() -> str:
    """How the surface is evaluated: in compiled C, or in NumPy with the reason why not in C."""
    return f"NumPy ({fault})" if (fault := LIBRARY.fault()) else "compiled C"


def shipped() -> dict[str, pin.Model]:
    """The models of the hands and arms that come with the package and whose descriptions are installed."""
    found: dict[str, pin.Model] = {}
    for name in available_hands():
        with suppress(InputError):
            found[name] = load_hand(name).model
    for name in available_arms():
        with suppress(InputError):
            found[name] = load_arm(name).model
    return found


def kinematics_backends() -> str:
    """The backends of the joint placements, for the hands and arms that come with the package."""
    by: dict[str, list[str]] = {}
    for name, model in shipped().items():
        by.setdefault(backend(model), []).append(name)
    return "; ".join(f"{using} ({', '.join(names)})" for using, names in by.items()) if len(by) > 1 else "".join(by)


def kinematics_lacks() -> dict[str, str]:
    """For each backend better than the walk, why it does not run for the package's hands and arms; "" if it does."""
    lacks: dict[str, str] = {}
    models = shipped()
    for using in BACKENDS[:-1]:
        reasons: dict[str, list[str]] = {}
        for name, model in models.items():
            if reason := lack(model, using):
                reasons.setdefault(reason, []).append(name)
        told = [r if len(names) == len(models) else f"not for {', '.join(names)}: {r}" for r, names in reasons.items()]
        lacks[using] = "; ".join(told)
    return lacks


def _processor() -> str:
    names = [line.split(":", 1)[1].strip() for line in processor().splitlines() if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
