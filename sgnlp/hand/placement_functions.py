"""The placements of all joints by Pinocchio on CasADi scalars, as a serialised function of each model.

    (q (n,) [rad or m]) -> rotations (3, 3 J), positions (3, J) [m]

of the J joints, side by side, in the frame of the model's root. `placements.cpp` makes the function of any model. It is
built on request, once for each version of Pinocchio and CasADi, into the user's cache, which also keeps its results.
The package contains the functions of its own hands and arms, so that these need no compiler. A function is found by the
digest of its model, and used only if it agrees with numeric Pinocchio.
"""

import hashlib
import subprocess
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from sgnlp.base import toolchain
from sgnlp.base.arrays import Array
from sgnlp.base.compilers import CPP
from sgnlp.base.errors import SolverError
from sgnlp.hand import library

SOURCE = "placements.cpp"
FLAGS = ("-std=c++17", "-O0", "-w", "-DNDEBUG")  # it runs for milliseconds
LIBRARIES = ("-lcasadi",)
TIMEOUT = 60.0
"""Time limit for the placements of a model [s]; they usually take 0.05 s."""

PROBES = ((0.2, 0.9), (-0.7, 0.4))
"""Joint coordinates of the digest [rad or m]: the first and the last one, the others evenly between."""
DECIMALS = 7
"""Rounding of these placements [m]: far above the differences of sines between machines."""
CHECKS = ((1.1, -0.5), (-0.3, -1.3), (0.6, 0.1))
"""Joint coordinates at which a function must agree with numeric Pinocchio."""
EXACT = 1e-12


def function(model: pin.Model) -> ca.Function | None:
    """The function of a model, from the package or the cache; None if none can be read and agrees with Pinocchio."""
    return _found(model)[1]


def text(model: pin.Model) -> str:
    """The serialised function of a model, equal for all versions of CasADi that can read it; "" if there is none."""
    return _found(model)[0]


def lack(model: pin.Model) -> str:
    """Why a model has no function, with the remedy; "" if it has one."""
    if function(model) is not None:
        return ""
    if any(True for _ in _texts(model)):
        return f"CasADi {ca.__version__} cannot read the function that there is of this model; a newer one can"
    return fault() or "no function of this model is carried or built; sgnlp cache --build --hand HAND builds it"


def fault() -> str:
    """Why functions cannot be built on this machine, with the remedy; "" if they can."""
    prefix = Path(pin.__file__).parents[4]
    if not (prefix / "include" / "pinocchio").is_dir():
        return f"Pinocchio's C++ headers are not in '{prefix}'; install it by pip"
    return CPP.fault() or toolchain.cache_fault()


def build(model: pin.Model) -> None:
    """Put the function of a model into the cache, unless there is one.

    Raises:
        SolverError: there is no compiler, it fails, the cache cannot be written, or the function is wrong.
        MachineError: there is no room for it.
    """
    if function(model) is None:
        text = make(model)
        if _read(text, model) is None:
            raise SolverError(f"the placements that {SOURCE} makes of this model are not those of Pinocchio")
        toolchain.keep(_kept(model), text.encode())


def make(model: pin.Model) -> str:
    """The serialised function of a model, by the C++ program, which is built first if it is not in the cache.

    Raises:
        SolverError: there is no compiler, it fails, the cache cannot be written, or the program fails.
        MachineError: there is no room for it.
    """
    if reason := fault():
        raise SolverError(reason)
    text = described(model).encode()
    command = [str(program())]
    try:
        done = subprocess.run(command, input=text, capture_output=True, check=True, timeout=TIMEOUT)
    except (OSError, subprocess.SubprocessError) as error:
        said = (getattr(error, "stderr", None) or str(error).encode()).decode(errors="replace")
        raise SolverError(f"the program of {SOURCE} fails: {' '.join(said.split())}") from None
    return done.stdout.decode()


def program() -> Path:
    """The C++ program, built if it is not in the cache: seconds and 0.6 GB of memory. Raises as `make`."""
    casadi, pinocchio = Path(ca.__file__).parent, Path(pin.__file__).parents[4]
    includes = [pinocchio / "include", casadi / "include"]
    eigens = [folder / "eigen3" for folder in (*includes, Path("/usr/include"))]  # CasADi's wheels bring one
    flags = (*FLAGS, *(f"-I{folder}" for folder in (*includes, *eigens)))
    libraries = (f"-L{casadi}", *LIBRARIES, f"-Wl,-rpath,{casadi}")
    source = files("sgnlp.hand").joinpath(SOURCE).read_text(encoding="utf-8")
    key = toolchain.fingerprint(source, *flags, *libraries, ca.__version__, pin.__version__, compiler=CPP)
    target = toolchain.cache_folder() / f"placements-{key}"
    linking = toolchain.Linking(CPP, ("-s",), libraries)
    toolchain.once(target, lambda: toolchain.build(target, {SOURCE: source}, flags, linking=linking), CPP)
    return target


def described(model: pin.Model) -> str:
    """A model as the C++ program reads it: one row for each joint, and for each part of a composite one.

    Raises:
        SolverError: it has a joint, or a part of one, that neither turns nor slides.
    """
    rows, last = list[str](), {0: 0}  # the row, from 1 on, that has the placement of each joint
    for joint in range(1, model.njoints):
        parts, before = _parts(model.joints[joint], model.jointPlacements[joint]), last[model.parents[joint]]
        for i, (part, place) in enumerate(parts, start=1):
            if part.nq > 1 or (subspace := _subspace(part, model.nq))[:3].any() == subspace[3:].any():
                raise SolverError(f"joint '{model.names[joint]}' is {part.shortname()}: not supported")
            mimic = part.extract() if part.nq == 0 else None
            coordinate = model.idx_qs[joint] if mimic else part.idx_q
            factor, offset = (mimic.scaling, mimic.offset) if mimic else (1.0, 0.0)
            turns = bool(subspace[3:].any())
            axis = (subspace[3:] if turns else subspace[:3]) / factor
            kind = (before, coordinate, int(i == len(parts)), int(mimic is not None), int(turns))
            numbers = (factor, offset, *axis, *place.rotation.ravel(), *place.translation)
            rows.append(" ".join(map(repr, (*kind, *map(float, numbers)))))
            before = len(rows)
        last[joint] = before
    return "\n".join([f"{model.nq} {model.njoints - 1} {len(rows)}", *rows])


def _parts(joint: Any, place: pin.SE3) -> list[tuple[Any, pin.SE3]]:
    """The joints that a composite consists of, each with its placement in the frame of the one before; else itself."""
    own = joint.extract() if joint.shortname().startswith("JointModelComposite") else None
    if own is None:
        return [(joint, place)]
    inner = [pair for part, at in zip(own.joints, own.jointPlacements, strict=True) for pair in _parts(part, at)]
    return [(inner[0][0], place * inner[0][1]), *inner[1:]]


def motion_subspace(model: pin.Model, joint: int) -> Array:
    """The motion subspace (6,) of a joint with one coordinate, linear part first, the same at every angle.

    For a mimic joint it is multiplied by the multiplier.
    """
    return _subspace(model.joints[joint], model.nq)


def _subspace(joint: Any, nq: int) -> Array:
    data = joint.createData()
    joint.calc(data, np.zeros(nq))
    return np.asarray(data.S).ravel()


def file_name(model: pin.Model) -> str:
    """The name of the file with the function of a model."""
    return f"placements-{digest(model)}.casadi"


def digest(model: pin.Model) -> str:
    """A digest that differs between models with different placements."""
    rounded = np.concatenate([_placed(model, *probe) for probe in PROBES]).round(DECIMALS) + 0.0  # no -0.0
    return hashlib.sha256(f"{model.nq} {model.njoints}".encode() + rounded.tobytes()).hexdigest()[:16]


def _texts(model: pin.Model) -> Iterator[str]:
    """Candidates for the serialised function of a model: from the package, then from the cache."""
    if (carried := library.beside(file_name(model))) is not None:
        yield carried.read_text(encoding="utf-8")
    if kept := toolchain.note_of(_kept(model)):
        yield kept.decode()


def _found(model: pin.Model) -> tuple[str, ca.Function | None]:
    """The first of these texts that is the function of the model, and the function."""
    read = ((text, _read(text, model)) for text in _texts(model))
    return next(((text, found) for text, found in read if found is not None), ("", None))


def _kept(model: pin.Model) -> Path:
    return toolchain.cache_folder() / file_name(model)


def _read(text: str, model: pin.Model) -> ca.Function | None:
    """The function in a text; None if this CasADi cannot read it, or it belongs to another model."""
    try:
        found = ca.Function.deserialize(text)
    except RuntimeError:
        return None
    if found.is_null() or (found.size_in(0), found.size_out(1)) != ((model.nq, 1), (3, model.njoints - 1)):
        return None
    for check in CHECKS:
        rotations, positions = (np.array(part) for part in found(_configuration(model, *check)))
        parts = zip(np.split(rotations, model.njoints - 1, axis=1), positions.T, strict=True)
        values = np.concatenate([np.column_stack(part).ravel() for part in parts])
        if np.abs(values - _placed(model, *check)).max() > EXACT:
            return None
    return found


def _placed(model: pin.Model, first: float, last: float) -> Array:
    """Rotation beside position (12 J,) of every joint, by numeric Pinocchio."""
    data = model.createData()
    pin.forwardKinematics(model, data, _configuration(model, first, last))
    return np.concatenate([placement.homogeneous[:3].ravel() for placement in list(data.oMi)[1:]])


def _configuration(model: pin.Model, first: float, last: float) -> Array:
    return np.asarray(pin.integrate(model, pin.neutral(model), np.linspace(first, last, model.nv)))
