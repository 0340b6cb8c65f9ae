"""What runs here: versions, machine, kinematics backend and solvers."""

import importlib.metadata
import platform
import subprocess
from pathlib import Path
from typing import Any

import casadi as ca

from sgnlp.base.toolchain import processor
from sgnlp.hand.kinematics import backend
from sgnlp.surface.native import attempt

PACKAGES = ("sgnlp", "casadi", "pin", "example-robot-data", "numpy", "scipy", "open3d", "mujoco", "coacd")
CODE = ("sgnlp", "urdf", "problems")
"""Folders of the checkout on which results depend."""


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result depends on; "missing" if one is not installed."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "missing"
    return found


def commit() -> str:
    """The commit of the code that runs, with "+ changes" if its files differ from it; "none" outside a checkout."""
    try:
        return _git("rev-parse", "HEAD") + (" + changes" if _git("status", "--porcelain", "-uno", "--", *CODE) else "")
    except (OSError, subprocess.CalledProcessError):
        return "none"


def _git(*arguments: str) -> str:
    folder = Path(__file__).parents[2]
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
    """How the surface is evaluated: in compiled C, or in NumPy where that cannot be had, with the reason."""
    library, fault = attempt()
    return "compiled C" if library is not None else f"NumPy ({fault})"


def kinematics_backend() -> str:
    """The symbolic forward kinematics in use."""
    return backend()


def _processor() -> str:
    names = [line.split(":", 1)[1].strip() for line in processor().splitlines() if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
