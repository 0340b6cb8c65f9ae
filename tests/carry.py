"""Write the functions that the package carries, beside the descriptions of the hands and arms in `urdf/`.

They are the placement functions of each hand and arm, and of the hand that is planned for if none is named the
functions of its programs, by `robust` with a free wrist and nothing around. Run it with `python tests/carry.py` where a
description of `urdf/` is new or has changed, and before a release. It needs a C++ compiler, and
CasADi 3.8.0: CasADi reads what older versions have written, not what newer ones have, and 3.8.0 is the oldest version
whose wheel fits Pinocchio's.
"""

import lzma
import sys
from pathlib import Path

import casadi as ca
import pinocchio as pin

from sgnlp.base.errors import SgnlpError
from sgnlp.base.presets import ROBUST
from sgnlp.cli.flags import Planning
from sgnlp.hand import placement_functions
from sgnlp.hand.arm import available_arms, load_arm
from sgnlp.hand.hand import Hand, available_hands, load_hand
from sgnlp.planning.additions import NOTHING
from sgnlp.program import compiled, serialised
from sgnlp.program.nlp import build
from sgnlp.program.structure import Structure

CASADI = "3.8.0"
PRESET = 9 | lzma.PRESET_EXTREME
URDF = Path(__file__).parents[1] / "urdf"


def shipped() -> dict[str, pin.Model]:
    """The models of the hands and arms that come with the package."""
    hands = {name: load_hand(name).model for name in available_hands()}
    return hands | {name: load_arm(name).model for name in available_arms()}


def programs() -> dict[Path, tuple[Hand, Structure]]:
    """The programs whose functions are carried, by the files that these belong into."""
    hand = load_hand(Planning.hand, ROBUST.spheres)
    files = {compiled.file_name(hand, structure): (hand, structure) for structure in NOTHING.structures(ROBUST)}
    return {URDF / Planning.hand / str(name): given for name, given in files.items()}


def main() -> None:
    """Write the files, and remove those of models that are no more."""
    if ca.__version__ != CASADI:
        raise SystemExit(f"this is CasADi {ca.__version__}; the files are to be written by {CASADI}")
    for name, model in shipped().items():
        try:
            text = placement_functions.make(model)
        except SgnlpError as error:
            raise SystemExit(str(error)) from None
        for old in (URDF / name).glob("placements-*.casadi"):
            old.unlink()
        file = URDF / name / placement_functions.file_name(model)
        file.write_text(text, encoding="utf-8")
        sys.stdout.write(f"{file.relative_to(URDF.parent)}\n")
    for old in URDF.glob("*/program-*.xz"):
        old.unlink()
    for file, given in programs().items():
        file.write_bytes(lzma.compress(serialised.written(build(*given)), preset=PRESET))
        sys.stdout.write(f"{file.relative_to(URDF.parent)}: {file.stat().st_size / 1e6:.2f} MB\n")


if __name__ == "__main__":
    main()
