"""What runs here: versions, machine, kinematics backend and solvers."""

import importlib.metadata
import platform
from typing import Any

import casadi as ca

from sgnlp.kinematics import backend
from sgnlp.native import attempt
from sgnlp.toolchain import processor

PACKAGES = ("sgnlp", "casadi", "pin", "example-robot-data", "numpy", "scipy", "open3d", "mujoco", "coacd")


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result depends on; "missing" if one is not installed."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "missing"
    return found


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
