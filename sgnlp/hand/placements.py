"""The placements of all joints of a model as CasADi expressions, by the best backend on this machine.

* `pinocchio.casadi`: Pinocchio's recursion on CasADi scalars, from Python. The wheel on PyPI is built without it.
* `pinocchio (compiled)`: the same recursion, run once for each model in C++ (`sgnlp.hand.placement_functions`).
* `model walk`: the recursion in this file, for any model of revolute and prismatic joints.

All agree to 1e-12.
"""

from collections.abc import Callable
from typing import Literal, get_args

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.base.arrays import Array
from sgnlp.base.errors import InputError, unknown
from sgnlp.hand import placement_functions
from sgnlp.hand.placement_functions import motion_subspace

Backend = Literal["pinocchio.casadi", "pinocchio (compiled)", "model walk"]
BACKENDS: tuple[Backend, ...] = get_args(Backend)
"""The backends, the preferred one first."""

Chain = list[tuple[ca.SX, ca.SX]]
"""Rotation (3, 3) and position (3,) [m] of the universe and every joint in the frame of the model's root."""


def placements(model: pin.Model, angles: ca.SX, using: Backend) -> Chain:
    """The placements at the angles (n,) [rad or m].

    Raises:
        InputError: the backend does not run here for this model.
    """
    return [(ca.SX.eye(3), ca.SX(3, 1)), *_WAYS[usable(using, model)](model, angles)]


def backend(*models: pin.Model) -> Backend:
    """The best backend that runs here for all of these models."""
    return next(using for using in BACKENDS if not any(lack(model, using) for model in models))


def usable(using: Backend, *models: pin.Model) -> Backend:
    """The given backend, checked.

    Raises:
        InputError: the name is unknown, or the backend does not run here for one of the models.
    """
    if using not in BACKENDS:
        raise unknown("kinematics backend", using, BACKENDS)
    if reason := next(filter(None, (lack(model, using) for model in models)), ""):
        raise _unusable(using, reason)
    return using


def lack(model: pin.Model, using: Backend) -> str:
    """Why a backend does not run here for a model, with the remedy; "" if it does."""
    if using == "pinocchio (compiled)":
        return placement_functions.lack(model)
    if using == "pinocchio.casadi":
        try:
            import pinocchio.casadi  # noqa: F401
        except ImportError:
            return "Pinocchio is built without it, as the wheels of PyPI are; conda's is built with it"
    return ""


def identity(using: Backend, *models: pin.Model) -> str:
    """A text that identifies the expressions of a usable backend for models; other backends and versions differ.

    Raises:
        InputError: the functions of the models are missing.
    """
    if using == "pinocchio (compiled)":
        return using + "".join(_text(model) for model in models)
    return f"{using} {pin.__version__}"


def constant(values: Array) -> ca.SX:
    """A constant whose zeros are structural, so that products with it cost nothing."""
    return ca.sparsify(ca.SX(np.asarray(values, float)))


def _from_python(model: pin.Model, angles: ca.SX) -> Chain:
    import pinocchio.casadi as cpin

    symbolic = cpin.Model(model)
    data = symbolic.createData()
    cpin.forwardKinematics(symbolic, data, angles)
    return [(ca.sparsify(place.rotation), ca.sparsify(place.translation)) for place in list(data.oMi)[1:]]


def _from_function(model: pin.Model, angles: ca.SX) -> Chain:
    rotations, positions = _function(model)(angles)
    return list(zip(ca.horzsplit(rotations, 3), ca.horzsplit(positions), strict=True))


def _function(model: pin.Model) -> ca.Function:
    found = placement_functions.function(model)
    if found is None:
        raise _unusable("pinocchio (compiled)", placement_functions.lack(model))
    return found


def _text(model: pin.Model) -> str:
    found = placement_functions.text(model)
    if not found:
        raise _unusable("pinocchio (compiled)", placement_functions.lack(model))
    return found


def _unusable(using: Backend, reason: str) -> InputError:
    return InputError(f"the kinematics backend '{using}' does not run here: {reason}")


def _walked(model: pin.Model, angles: ca.SX) -> Chain:
    """Placements by recursion over the model's tree: parent · placement · motion."""
    chain: Chain = [(ca.SX.eye(3), ca.SX(3, 1))]
    for joint in range(1, model.njoints):
        rotation, position = chain[model.parents[joint]]
        placement = model.jointPlacements[joint]
        turn, shift = _motion(model, joint, angles[model.idx_qs[joint]])
        turn = ca.mtimes(constant(placement.rotation), turn)
        shift = constant(placement.translation) + ca.mtimes(constant(placement.rotation), shift)
        chain.append((ca.mtimes(rotation, turn), position + ca.mtimes(rotation, ca.sparsify(shift))))
    return chain[1:]


def _motion(model: pin.Model, joint: int, q: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rotation and translation of a revolute or prismatic joint, from its motion subspace.

    q is its coordinate, or that of the joint which it mimics.
    """
    subspace = motion_subspace(model, joint)
    if model.joints[joint].nq == 0:
        mimic = model.joints[joint].extract()
        subspace, q = subspace / mimic.scaling, mimic.scaling * q + mimic.offset
    linear, angular = subspace[:3], subspace[3:]
    if not angular.any():
        return ca.SX.eye(3), ca.sparsify(ca.SX(linear) * q)
    if linear.any():
        raise InputError(f"joint '{model.names[joint]}' is {model.joints[joint].shortname()}: not supported")
    outer = np.outer(angular, angular)
    turn = outer + ca.cos(q) * (np.eye(3) - outer) + ca.sin(q) * pin.skew(angular)  # Rodrigues
    return ca.sparsify(turn), ca.SX(3, 1)


_WAYS: dict[Backend, Callable[[pin.Model, ca.SX], Chain]] = {
    "pinocchio.casadi": _from_python,
    "pinocchio (compiled)": _from_function,
    "model walk": _walked,
}
