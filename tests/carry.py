"""Write the placement functions that the package carries, beside the description of each hand and arm in `urdf/`.

Run it with `python tests/carry.py` where a description of `urdf/` is new or has changed. It needs a C++ compiler, and
CasADi 3.8.0: CasADi reads what older versions have written, not what newer ones have, and 3.8.0 is the oldest version
whose wheel fits Pinocchio's.
"""

import sys
from pathlib import Path

import casadi as ca
import pinocchio as pin

from sgnlp.base.errors import SgnlpError
from sgnlp.hand import placement_functions
from sgnlp.hand.arm import available_arms, load_arm
from sgnlp.hand.hand import available_hands, load_hand

CASADI = "3.8.0"
URDF = Path(__file__).parents[1] / "urdf"


def shipped() -> dict[str, pin.Model]:
    """The models of the hands and arms that come with the package."""
    hands = {name: load_hand(name).model for name in available_hands()}
    return hands | {name: load_arm(name).model for name in available_arms()}


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


if __name__ == "__main__":
    main()
