"""Make the golden functions: fingertip positions by genuine Pinocchio on CasADi scalars (see README.md)."""

import sys
from pathlib import Path

import casadi as ca
from casadi_kin_dyn.casadi_kin_dyn import CasadiKinDyn

TIPS = ("link_3.0_tip", "link_7.0_tip", "link_11.0_tip", "link_15.0_tip")  # index, middle, ring, thumb


def tips(urdf: Path) -> ca.Function:
    """The function (wrist (7,), joints (16,), v (22,)) -> tips (4, 3), with the joints in Pinocchio's order."""
    robot = CasadiKinDyn(urdf.read_text(encoding="utf-8"), CasadiKinDyn.JointType.FREE_FLYER)
    wrist, joints, v = ca.SX.sym("wrist", 7), ca.SX.sym("joints", robot.nq() - 7), ca.SX.sym("v", robot.nv())
    q = robot.integrate()(ca.vertcat(wrist, joints), v)
    positions = [robot.fk(tip)(q)[0] for tip in TIPS]
    return ca.Function("tips", [wrist, joints, v], [ca.horzcat(*positions).T])


if __name__ == "__main__":
    for side, urdf in zip(("left", "right"), sys.argv[1:], strict=True):
        tips(Path(urdf)).save(str(Path(__file__).with_name(f"allegro_{side}_fk.casadi")))
