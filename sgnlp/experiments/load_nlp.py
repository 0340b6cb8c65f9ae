"""Load the nonlinear program in this folder: min f(x), lbg ≤ g(x) ≤ ubg, lbx ≤ x ≤ ubx. It needs only CasADi."""

import json
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np


def load(folder: Path = Path(__file__).parent) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any], dict[str, Any]]:
    """The program, and the options with its exact derivatives, for `ca.nlpsol`; its arrays; its description."""
    functions = {
        file.stem: ca.Function.deserialize(file.read_text(encoding="utf-8")) for file in folder.glob("*.casadi")
    }
    with np.load(folder / "nlp.npz") as arrays:
        numbers = dict(arrays)
    x = ca.MX.sym("x", len(numbers["x0"]))
    f, g = functions["nlp"](x)
    exact = {"grad_f": functions["gradient"], "jac_g": functions["jacobian"], "hess_lag": functions["hessian"]}
    return {"x": x, "f": f, "g": g}, exact, numbers, json.loads((folder / "about.json").read_text(encoding="utf-8"))
