"""Every number that a user may change, with its source. Settings are frozen; `sgnlp.base.presets` has instances."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from sgnlp.base.checked import NOT_NEGATIVE, POSITIVE, Checked, Interval


@dataclass(frozen=True)
class GpisSettings(Checked):
    """How the implicit surface is fitted."""

    section = "gpis"
    valid: ClassVar[dict[str, Interval]] = {
        "surface_points": (10, 5000),
        "interior_points": (1, 5000),
        "surface_noise": POSITIVE,
        "exterior_noise": POSITIVE,
        "interior_noise": POSITIVE,
        "cube_scale": (1.0, 10.0),
        "cube_half_min": POSITIVE,
        "interior_value": (-10.0, 0.0),
        "interior_temperature": POSITIVE,
        "support_scale": (1.0, 10.0),
    }

    kernel: str = "thin_plate"
    """thin_plate, matern32, matern52 or squared_exponential"""
    surface_points: int = 200
    """measured points kept by farthest-point sampling (release: 200)"""
    interior_points: int = 50
    """mixtures of measured points (paper: 50)"""
    surface_noise: float = 0.005
    """deviation of a measured point [m] (paper: 0.005)"""
    exterior_noise: float = 0.2
    """deviation of an exterior point [m] (paper: 0.2)"""
    interior_noise: float = 0.05
    """deviation of an interior point [m] (paper: 0.05)"""
    cube_scale: float = 1.2
    """edge of the exterior cube over the longest edge of the object's box (paper: 120 %)"""
    cube_half_min: float = 0.1
    """least half edge of the exterior cube [m] (release: 0.1)"""
    interior_value: float = -0.3
    """value of interior points, in half edges of the cube (release: -0.3)"""
    interior_temperature: float = 0.01
    """temperature of the softmax of the interior mixtures (release: 1/100)"""
    prior_mean: float = 1.0
    """prior mean of the thin plate [m] (release: 1); that of the other kernels is the exterior value"""
    support_scale: float = 1.5
    """R of the kernel over the largest distance between training points; at 1, as in the release, the thin plate is
    not quite positive definite and the palm leaves its ball"""
    floor: bool = True
    """copy the cloud onto the table, so that the surface closes below (release)"""


@dataclass(frozen=True)
class Weights(Checked):
    """Weights of the energy terms (paper, table of weights)."""

    section = "weights"
    valid: ClassVar[dict[str, Interval]] = dict.fromkeys(
        ("sp", "dist", "uncer", "gain", "tar", "col", "reg", "force", "pose", "stability", "closure"), NOT_NEGATIVE
    )

    sp: float = 200.0
    """contact margins at first contact and at equilibrium"""
    dist: float = 1e4
    """distance of the contacts to the surface [1/m]"""
    uncer: float = 20.0
    """prominence of the contact density along the finger's path; deviation at the contacts [1/m] for force closure"""
    gain: float = 0.5
    """sum of the gains [m/N]"""
    tar: float = 1000.0
    """posterior mean at the targets [1/m]"""
    col: float = 1.0
    """collisions of the hand with itself, the object and the table"""
    reg: float = 10.0
    """joint angles off the reference pose, motion to the equilibrium"""
    force: float = 200.0
    """contact force up to `limits.force_min` [1/N]; the paper prints it twice, it is applied once"""
    pose: float = 0.0
    """fingertips off their desired place at equilibrium [1/m]; above 0 it replaces the motion in `reg`"""
    stability: float = 1.0
    """log of the equilibrium's stiffness: without it targets drift together until the equilibrium is undefined"""
    closure: float = 200.0
    """net force and torque of the contact forces [1/N], where `contact.metric` is closure (paper: 200)"""


@dataclass(frozen=True)
class Contact(Checked):
    """The model of contact and of the grasping motion."""

    section = "contact"
    valid: ClassVar[dict[str, Interval]] = {
        "c": (1e-3, 1.0),
        "friction": POSITIVE,
        "samples": (2, 1000),
        "mass": NOT_NEGATIVE,
        "heuristic": NOT_NEGATIVE,
    }

    metric: Literal["spring", "closure"] = "spring"
    """spring: the equilibrium that springs pull the object to; closure: force closure at first contact (bilevel)"""
    heuristic: float = 0.0
    """α of gains k = α/σ that the contacts' deviations dictate [N]; 0 leaves the gains free"""
    c: float = 0.7
    """contact p = o + c (a - o) between target o and pregrasp tip a (paper: 0.7)"""
    friction: float = 1.0
    """friction coefficient that the plan counts on (release: 1.0)"""
    pad: bool = True
    """contact is where the fingertip's sphere touches; off: where its centre lies on the surface, as in the paper"""
    samples: int = 10
    """samples of the contact density along a finger's path, K (release: 10)"""
    density: Literal["share", "density"] = "share"
    """E_uncer from each contact's share of the density on its path (release), or from the density [1/m] (paper)"""
    mass: float = 0.0
    """mass of the object [kg]; 0 leaves gravity out of the equilibrium, as the paper"""
    displacement: tuple[float, float, float] = (0.0, 0.0, 0.01)
    """desired displacement of the object's middle at equilibrium [m], if `weights.pose` > 0 (paper: up by 1 cm)"""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """desired rotation vector of the object about its middle at equilibrium [rad], if `weights.pose` > 0"""
    equilibrium: Literal["exact", "printed"] = "exact"
    """exact: the minimiser of the spring energy; printed: the paper's Algorithm 1, for comparison only"""


@dataclass(frozen=True)
class Limits(Checked):
    """Bounds of the constrained formulation; the stiffness and rotation ones hold in every formulation."""

    section = "limits"
    valid: ClassVar[dict[str, Interval]] = {
        "margin_initial": (-1.0, 1.0),
        "margin_equilibrium": (-1.0, 1.0),
        "force_min": NOT_NEGATIVE,
        "force_max": POSITIVE,
        "stiffness": POSITIVE,
        "rotation_deg": (1e-3, 180.0),
        "shift": POSITIVE,
        "gain_min": POSITIVE,
        "gain_max": POSITIVE,
        "gain_fixed": NOT_NEGATIVE,
        "wrist_travel": POSITIVE,
        "effort": NOT_NEGATIVE,
    }

    margin_initial: float = 0.0
    """least contact margin at first contact"""
    margin_equilibrium: float = 0.05
    """least contact margin at equilibrium"""
    force_min: float = 2.0
    """least force of a finger at equilibrium [N] (paper: 2)"""
    force_max: float = 10.0
    """largest force of a finger at equilibrium [N]"""
    stiffness: float = 0.005
    """least rotational stiffness ρ of the equilibrium [N m]"""
    rotation_deg: float = 20.0
    """largest rotation of the object on its way to the equilibrium [deg]"""
    shift: float = 0.05
    """largest displacement of a contact on its way to the equilibrium [m]"""
    gain_min: float = 40.0
    """least gain [N/m] (release: clamped at 40)"""
    gain_max: float = 400.0
    """largest gain [N/m]"""
    gain_fixed: float = 0.0
    """fix every gain at this many times the hand's initial gain; 0 leaves them free between the two above"""
    table_margin: float = 0.0
    """least clearance over the table of every sphere but the pads, at the pregrasp [m]"""
    pad_margin: float = 0.002
    """least clearance over the table of the pads at the pregrasp [m]"""
    object_margin: float = 0.0
    """least metric clearance between the hand and the object at the pregrasp [m]"""
    wrist_travel: float = 0.3
    """largest displacement of the wrist from its start, along each axis [m]"""
    effort: float = 0.0
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
    valid: ClassVar[dict[str, Interval]] = dict.fromkeys(
        ("distance", "collision", "log", "force", "deviation", "exponent"), POSITIVE
    )

    distance: float = 5e-4
    """δ of |d| → √(d² + δ²) [m]"""
    collision: float = 1.5e-3
    """width of the softplus hinge of a penetration [m]"""
    log: float = 0.02
    """η of log u → log((u + √(u² + 4η²))/2)"""
    force: float = 0.1
    """width of min(f_min, |f|), and of |F| → √(|F|² + w²) for the net force and torque of force closure [N, N m]"""
    deviation: float = 5e-4
    """floor of the metric deviation in the contact density [m]"""
    exponent: float = 30.0
    """saturation of the exponent of the contact density"""


Formulation = Literal["penalty", "constrained", "two_phase", "elastic", "lifted"]


@dataclass(frozen=True)
class Solver(Checked):
    """Formulation, Ipopt's options and limits."""

    section = "solver"
    valid: ClassVar[dict[str, Interval]] = {
        "penalty_iterations": (1, 100_000),
        "max_iterations": (1, 100_000),
        "tolerance": POSITIVE,
        "mu_init": POSITIVE,
        "barrier_tolerance": POSITIVE,
        "elastic_weight": POSITIVE,
    }

    formulation: Formulation = "two_phase"
    """the whole energy; constraints with the rest of the energy; a few iterations of the first, then the second; or
    then the second with slacks: it tells which constraints cannot be met, and by how much; or the second alone over
    tips and the pose at equilibrium too"""
    elastic_weight: float = 30.0
    """cost of a violation by the scale of its row (1 cm, 1 N, a margin of 1), in 100 of the energy, where elastic"""
    penalty_iterations: int = 25
    """iterations of the first phase of two_phase and of elastic"""
    max_iterations: int = 400
    """iterations of a phase at most"""
    tolerance: float = 1e-6
    """Ipopt's convergence tolerance on the scaled problem"""
    mu_strategy: Literal["monotone", "adaptive"] = "monotone"
    """barrier strategy"""
    mu_init: float = 0.1
    """first barrier parameter μ"""
    barrier_tolerance: float = 100.0
    """error over μ at which μ is lowered (Ipopt: 10, which takes a fifth more iterations and solves no more starts)"""
    compiled: bool = True
    """use compiled C: for the surface where a compiler is found, for the rest where `sgnlp cache --build` was run"""
    linear_solver: Literal["mumps", "spral"] = "mumps"
    """linear solver of Ipopt: mumps or spral in casadi's wheel"""


@dataclass(frozen=True)
class Settings(Checked):
    """All settings of a plan."""

    gpis: GpisSettings = field(default_factory=GpisSettings)
    contact: Contact = field(default_factory=Contact)
    weights: Weights = field(default_factory=Weights)
    limits: Limits = field(default_factory=Limits)
    smoothing: Smoothing = field(default_factory=Smoothing)
    solver: Solver = field(default_factory=Solver)
    spheres: Literal["cover", "paper"] = "cover"
    """collision spheres: cover the meshes of every link, or the paper's 16"""
    rank_by: Literal["margin", "margin_initial", "energy", "stiffness"] = "margin"
    """key of the ranking among feasible grasps: worst margin, that at first contact, exact energy or stiffness ρ"""
