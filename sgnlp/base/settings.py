"""All numbers that a user may change, with their sources. Settings are frozen; `sgnlp.base.presets` has presets."""

from dataclasses import dataclass, field
from math import pi
from typing import Annotated, Literal

from sgnlp.base.checked import Checked, Positive
from sgnlp.base.ranges import (
    TINY,
    Compliance,
    Distance,
    Factor,
    Force,
    Friction,
    Gain,
    JointStiffness,
    LargestForce,
    Margin,
    Mass,
    PositiveJointStiffness,
    Seconds,
    Speed,
    Travel,
    Turn,
    Weight,
    Width,
)
from sgnlp.base.surface_settings import FreeSpace, GpisSettings


@dataclass(frozen=True)
class Weights(Checked):
    """Weights of the energy terms (paper, table of weights)."""

    section = "weights"
    sp: Weight = 200.0
    """contact margins at first contact and at equilibrium"""
    dist: Weight = 1e4
    """distance of the contacts to the surface [1/m]"""
    uncer: Weight = 20.0
    """prominence of the contact density along the finger's path; deviation at the contacts [1/m] for force closure"""
    gain: Weight = 0.5
    """sum of the gains [m/N]"""
    tar: Weight = 1000.0
    """posterior mean at the targets [1/m]"""
    col: Weight = 1.0
    """collisions of the hand with itself, the object and the table"""
    reg: Weight = 10.0
    """deviation of the joints from the reference pose, and motion to the equilibrium"""
    force: Weight = 200.0
    """contact force up to `limits.force_min` [1/N]; the paper prints the weight twice, it is applied once"""
    closing: Weight = 10.0
    """deviation of the joints at first contact from those of the pregrasp [1/rad²], with `closing.planned`"""
    arm: Weight = 1e-3
    """deviation of the arm's joints from their home, and at stand-off and lift from the pregrasp [1/rad²]: it fixes the
    motion that the wrist's pose leaves free, and hardly affects the rest"""
    pose: Weight = 0.0
    """distance of the fingertips from their desired place at equilibrium [1/m]; above 0 it replaces the motion in
    `reg`"""
    stability: Weight = 1.0
    """log of the equilibrium's stiffness: without it targets drift together until the equilibrium is undefined"""
    closure: Weight = 200.0
    """net force and torque of the contact forces [1/N], with `contact.metric closure` (paper: 200)"""


@dataclass(frozen=True)
class Contact(Checked):
    """The model of contact and of the grasping motion."""

    section = "contact"
    metric: Literal["spring", "closure"] = "spring"
    """spring: the equilibrium that springs pull the object to; closure: force closure at first contact (bilevel)"""
    heuristic: Force = 0.0
    """α of gains k = α/σ that follow from the deviations at the contacts [N]; 0 leaves the gains free"""
    c: Annotated[float, (0.001, 1.0)] = 0.7
    """contact p = o + c (a - o) between target o and pregrasp tip a (paper: 0.7)"""
    friction: Friction = 1.0
    """friction coefficient that the plan assumes (release: 1.0)"""
    pad: bool = True
    """contact is where the fingertip's sphere touches; off: where its centre is on the surface, as in the paper"""
    samples: Annotated[int, (2, 1000)] = 10
    """samples of the contact density along a finger's path, K (release: 10)"""
    density: Literal["share", "density"] = "share"
    """E_uncer from each contact's share of the density on its path (release), or from the density [1/m] (paper)"""
    mass: Mass = 0.0
    """mass of the object [kg]; 0 leaves gravity out of the equilibrium, as the paper"""
    displacement: Annotated[tuple[float, float, float], (-1.0, 1.0)] = (0.0, 0.0, 0.01)
    """desired displacement of the object's middle at equilibrium [m], if `weights.pose` > 0 (paper: up by 1 cm)"""
    rotation: Annotated[tuple[float, float, float], (-pi, pi)] = (0.0, 0.0, 0.0)
    """desired rotation vector of the object about its middle at equilibrium [rad], if `weights.pose` > 0"""
    equilibrium: Literal["exact", "printed"] = "exact"
    """exact: the minimiser of the spring energy; printed: the paper's Algorithm 1, for comparison only"""


@dataclass(frozen=True)
class Closing(Checked):
    """The closing of the hand from the pregrasp to the contacts, and how much of it is planned."""

    section = "closing"
    planned: bool = False
    """plan the joints at first contact too: tips at the contacts, links clear of the object, torques by the Jacobian
    there; off: plan only the pregrasp, as in the paper"""
    margin: Margin = 0.002
    """least clearance of every link at first contact from the object and the table [m]"""
    c_freedom: Annotated[float, (0.0, 0.9)] = 0.0
    """largest difference of each finger's c from `contact.c`, so that a wide gap needs no more force; 0: c is
    constant"""
    samples: Annotated[int, (1, 100)] = 5
    """number of postures between pregrasp and first contact at which links are checked against the object"""
    seconds: Seconds = 1.0
    """time in which the setpoints move from the pregrasp tips to the targets [s]; 0: they jump"""
    posture: JointStiffness = 0.1
    """stiffness of the spring to the planned joints at contact, in joint motions that do not move a tip [N m/rad]"""
    joint_stiffness: PositiveJointStiffness = 1.0
    """stiffness of a joint under position control [N m/rad] (MuJoCo Menagerie's Allegro)"""


@dataclass(frozen=True)
class Motion(Checked):
    """The motion to the pregrasp, and the lift with the object."""

    section = "motion"
    standoff: Travel = 0.1
    """distance of the stand-off behind the pregrasp, against the direction that the palm faces [m]"""
    samples: Annotated[int, (1, 20)] = 4
    """number of postures on the approach, with the stand-off, at which the program keeps the hand clear of obstacles"""
    lift: Travel = 0.1
    """height to which the hand rises with the object [m]"""
    speed: Speed = 0.1
    """largest speed of the wrist on the approach and the lift [m/s]: slow enough to stop by hand"""
    speed_share: Annotated[float, (0.001, 1.0)] = 0.3
    """largest joint speed over the URDF's velocity limit: slow joints lag little behind their setpoints, and the path
    stays straight"""
    step: Annotated[float, (0.001, 0.1)] = 0.02
    """time between samples of the trajectory [s]"""
    frame: str = "world"
    """name of the world frame in the ROS messages of the trajectory"""


@dataclass(frozen=True)
class Limits(Checked):
    """Bounds of the constrained formulation; the stiffness and rotation ones hold in every formulation."""

    section = "limits"
    margin_initial: Annotated[float, (-1.0, 1.0)] = 0.0
    """least contact margin at first contact"""
    margin_equilibrium: Annotated[float, (-1.0, 1.0)] = 0.05
    """least contact margin at equilibrium"""
    force_min: Force = 2.0
    """least force of a finger at equilibrium [N] (paper: 2)"""
    force_max: LargestForce = 10.0
    """largest force of a finger at equilibrium [N]"""
    stiffness: PositiveJointStiffness = 0.005
    """least rotational stiffness ρ of the equilibrium [N m]"""
    rotation_deg: Annotated[float, (0.001, 180.0)] = 20.0
    """largest rotation of the object on its way to the equilibrium [deg]"""
    shift: Width = 0.05
    """largest displacement of a contact on its way to the equilibrium [m]"""
    give: Compliance = 0.0
    """largest displacement for each newton of the object's weight, if that is more than `shift` [m/N]"""
    gain_min: Gain = 40.0
    """least gain [N/m] (release: clamped at 40)"""
    gain_max: Gain = 400.0
    """largest gain [N/m]"""
    gain_fixed: Factor = 0.0
    """fix every gain at this many times the hand's initial gain; 0 leaves them free between the two above"""
    table_margin: Margin = 0.0
    """least clearance over the table of every sphere but the pads, at the pregrasp [m]"""
    pad_margin: Margin = 0.002
    """least clearance over the table of the pads at the pregrasp [m]"""
    object_margin: Margin = 0.0
    """least metric clearance between the hand and the object at the pregrasp [m]"""
    place_error: Distance = 0.0
    """error of the hand's position that the pregrasp allows for [m]: it is added to `object_margin`; less if no camera
    is known (`free_space.reserve`)"""
    place_error_tight: Distance = 0.016
    """the same, if that is less, where a wide gap is hard to keep [m]: by fingers with fewer than four joints each,
    which cannot draw far back along the line on which they press, and if no camera is known, for the surface bulges"""
    wrist_travel: Travel = 0.3
    """largest displacement of the wrist from its start, along each axis [m]"""
    obstacle_margin: Margin = 0.012
    """least clearance of hand and arm from obstacles on the whole way [m]: edges of the palm protrude this far from the
    spheres"""
    dexterity: Annotated[float, (1e-6, 1.0)] = 0.2
    """least manipulability √det(J Jᵀ) of an arm at the pregrasp over that at its home, away from singularities"""
    arm_turn: Turn = 0.8
    """largest turn of an arm's joint from the pregrasp to the stand-off and to the lift [rad]: beyond it the elbow
    flips"""
    region_margin: Margin = 0.003
    """distance of contact points outside regions to avoid, and inside those to touch [m]: the radius of a pad's
    patch"""
    effort: Factor = 0.0
    """largest joint torque Jᵀf over the hand's effort, at first contact and at equilibrium; 0 leaves torques free"""

    def __post_init__(self) -> None:
        """Also that no lower limit is above its upper one."""
        super().__post_init__()
        self._ordered("force_min", "force_max")
        self._ordered("gain_min", "gain_max")


@dataclass(frozen=True)
class Smoothing(Checked):
    """Widths of the smooth forms; the exact, non-smooth values are reported beside them."""

    section = "smoothing"
    distance: Width = 5e-4
    """δ of |d| → √(d² + δ²) [m]"""
    collision: Width = 1.5e-3
    """width of the softplus hinge of a penetration [m]"""
    log: Positive = 0.02
    """η of log u → log((u + √(u² + 4η²))/2)"""
    force: Positive = 0.1
    """width of min(f_min, |f|), and of |F| → √(|F|² + w²) for the net force and torque of force closure [N, N m]"""
    deviation: Width = 5e-4
    """floor of the metric deviation in the contact density [m]"""
    exponent: Positive = 30.0
    """saturation of the exponent of the contact density"""


Formulation = Literal["penalty", "constrained", "two_phase", "elastic", "lifted"]


@dataclass(frozen=True)
class Solver(Checked):
    """Formulation, Ipopt's options and limits."""

    section = "solver"
    formulation: Formulation = "two_phase"
    """penalty: the whole energy; constrained: constraints, with the rest of the energy; two_phase: a few iterations of
    penalty, then constrained; elastic: the same with slacks, which show the constraints that cannot be met and by how
    much; lifted: constrained, with tips and the pose at equilibrium as variables"""
    elastic_weight: Positive = 30.0
    """elastic: cost of a violation of one scale of its row (1 cm, 1 N, a margin of 1), in units of 100 of the energy"""
    penalty_iterations: Annotated[int, (1, 100000)] = 25
    """iterations of the first phase of two_phase and of elastic"""
    max_iterations: Annotated[int, (1, 100000)] = 400
    """largest number of iterations of a phase"""
    tolerance: Annotated[float, (TINY, 1.0)] = 1e-6
    """Ipopt's convergence tolerance on the scaled problem"""
    mu_strategy: Literal["monotone", "adaptive"] = "monotone"
    """barrier strategy"""
    mu_init: Positive = 0.1
    """first barrier parameter μ"""
    barrier_tolerance: Positive = 100.0
    """error over μ at which μ is lowered (Ipopt: 10, which takes a fifth more iterations and solves no more starts)"""
    compiled: bool = True
    """use compiled C: for the surface if there is a compiler, for the rest if it is in the cache (`sgnlp cache
    --build`)"""
    expect_infeasible: bool = True
    """notice sooner that a start cannot end feasible: Ipopt turns to restoration at once, and ends where that does not
    help. On 343 starts of the tuning half as many end feasible, and the others take half as many iterations. Not for
    force closure, where it gives up programs that have a solution"""
    linear_solver: Literal["condensed", "mumps", "spral"] = "condensed"
    """linear solver of Ipopt: condensed (ours; without a C compiler mumps takes its place), mumps or spral"""


@dataclass(frozen=True)
class Settings(Checked):
    """All settings of a plan."""

    gpis: GpisSettings = field(default_factory=GpisSettings)
    free_space: FreeSpace = field(default_factory=FreeSpace)
    contact: Contact = field(default_factory=Contact)
    weights: Weights = field(default_factory=Weights)
    closing: Closing = field(default_factory=Closing)
    motion: Motion = field(default_factory=Motion)
    limits: Limits = field(default_factory=Limits)
    smoothing: Smoothing = field(default_factory=Smoothing)
    solver: Solver = field(default_factory=Solver)
    spheres: Literal["cover", "paper"] = "cover"
    """collision spheres: cover the meshes of every link, or the paper's 16"""
    rank_by: Literal["margin", "margin_initial", "energy", "stiffness", "confidence"] = "margin"
    """ranking of feasible grasps: by worst margin, by worst margin at first contact, by exact energy, by stiffness ρ,
    or by the confidence that it holds"""
