"""Numbers of the simulation, each with its source."""

from dataclasses import dataclass
from typing import Annotated, Literal

from sgnlp.base.checked import NOT_NEGATIVE, Checked, NotNegative, Positive
from sgnlp.base.errors import InputError
from sgnlp.base.ranges import BodyMass, Distance, Friction, JointDamping, Travel

SAMPLE = 0.01
"""Time between readings [s]."""
ROUNDING = 1e-6
"""Relative rounding of a time step written in decimals."""
STEPS_OF_A_CONTACT = 2
"""Least number of time steps in the time constant of a contact: MuJoCo silently raises smaller ones to two steps."""


@dataclass(frozen=True)
class SimulationSettings(Checked):
    """The object, the hand's control and joints, contact, the phases and the judgement."""

    section = "simulation"
    mass: BodyMass = 0.1
    """mass of the object [kg], spread evenly over its volume (the paper's objects: 0.02 to 0.5). If it is not given,
    `sgnlp simulate` uses the mass that the plan assumes"""
    friction: Friction = 1.0
    """Coulomb's coefficient of every contact (the paper's release plans with 1). If it is not given, `sgnlp simulate`
    uses the friction that the plan assumes"""
    control: Literal["impedance", "position"] = "impedance"
    """impedance: a spring from each tip to its target; position: a spring in each joint, to the plan's
    joints_squeeze"""
    place_error: Distance = 0.0
    """shift of the hand from its planned place, in a random horizontal direction [m]"""
    turn_error: Annotated[float, (0.0, 180.0)] = 0.0
    """turn of the hand about the middle of its pregrasp tips, about a random axis [deg]"""
    seed: Annotated[int, NOT_NEGATIVE] = 0
    """seed of these two directions"""
    timestep: Annotated[float, (1e-05, 0.002)] = 0.002
    """time step [s]; half of it gives the same outcomes (tests/simulation). MuJoCo needs at most half of
    contact_time"""
    joint_damping: JointDamping = 0.1
    """viscous friction of a joint [N m s] (MuJoCo Menagerie's Allegro; the URDF's 3 to 10 are placeholders)"""
    joint_friction: NotNegative = 0.03
    """dry friction of a joint [N m]: 4 % of the rated torque, what a gear of 369:1 loses without load (an estimate; the
    URDF's 5 to 12 are placeholders). Four joints move three coordinates of a tip: without friction a pad turns about
    its centre like a caster, and the object sags between the pads"""
    joint_armature: Positive = 1e-3
    """rotor inertia seen at a joint [kg m²]; with it a tip weighs 0.1 to 1 kg, and 2√k is critical for 1 kg"""
    pad_patch: Distance = 0.003
    """radius of the patch of contact of a pad [m]: Hertz for 4 N, 12 mm and 1 MPa; it resists twist"""
    contact_time: Positive = 0.005
    """time constant of a contact [s]; the pads give way by less than 0.1 mm under 10 N"""
    contact_impedance: Annotated[float, (0.5, 0.9999)] = 0.99
    """MuJoCo's impedance of a contact, 1 for a rigid one; with `friction_impedance` a held object creeps by less than
    0.1 mm/s (tests/simulation)"""
    friction_impedance: Annotated[float, (1.0, 10000.0)] = 100.0
    """stiffness of friction over that of the normal force"""
    arm_give: Positive = 0.03
    """deflection of an arm's joint at which its servo gives the whole effort [rad or m]: 2900 N m/rad in the large
    joints of a Panda (the examples of its maker's libfranka: 2000 to 3000), critically damped"""
    arm_armature: Positive = 0.1
    """rotor inertia seen at a joint of an arm [kg m² or kg] (MuJoCo Menagerie's Panda)"""
    collision_force: Positive = 20.0
    """force of hand or arm on an obstacle, or of the arm on table, object or hand, that counts as a collision [N]: at
    this force the examples of libfranka let a Panda stop"""
    piece_error: Positive = 0.002
    """largest concavity that a convex piece of the object may stand for [m]"""
    close_time: Positive = 6.0
    """longest wait for rest after the setpoints have reached their ends [s]"""
    lift_height: Travel = 0.05
    """[m] (paper: 5 cm)"""
    lift_time: Positive = 1.0
    """[s]"""
    hold_time: Positive = 2.0
    """time in the air before the judgement [s]"""
    push_time: Positive = 1.0
    """duration of each of the six pushes [s]; 0.2 s is the slowest spring's time constant 2/√k"""
    push_weights: NotNegative = 1.0
    """force of a push over the object's weight; 0 leaves the pushes out"""
    max_penetration: Positive = 0.005
    """a pregrasp deeper than this in object, table or an obstacle is in collision and not carried out [m]"""
    rise: Positive = 0.02
    """least rise of the object during the whole hold to count as lifted [m]; a spring sags by m g/Σk"""
    rise_strict: Positive = 0.04
    """the same for the strict score [m]"""
    slip_limit: Positive = 0.01
    """longest path of a pad over the surface during lift and hold, rolling excluded [m]"""

    def __post_init__(self) -> None:
        """Also that contacts are not stiffer than the step can resolve, and that samples are whole steps."""
        super().__post_init__()
        self._ordered("rise", "rise_strict")
        steps = SAMPLE / self.timestep
        if abs(steps - round(steps)) > ROUNDING * steps:
            raise InputError(f"--simulation.timestep must be {SAMPLE:g} s over a whole number, not {self.timestep:g}")
        if self.timestep > self.contact_time / STEPS_OF_A_CONTACT:
            least = f"--simulation.contact-time must be at least {STEPS_OF_A_CONTACT} times --simulation.timestep"
            raise InputError(f"{least}, {STEPS_OF_A_CONTACT * self.timestep:g}, not {self.contact_time:g}")
