"""By how much the exact rows of a feasible grasp may miss their bounds, each with its reason."""

ROUNDING = 1e-6
"""Tolerance of what a solver meets to 1e-8: margins [1], shares of the effort [1], the surface model's ball [m]."""
REACHED = 1e-4
"""By how much the tips may miss the planned contacts at the joints of first contact [m]."""
CONTACT = 2e-3
"""Largest |distance| of a pad to the surface that counts as contact [m]."""
CLEARANCE = 1e-3
"""By how much a clearance may be missed [m]: the surface itself is known no better."""
STABLE = 1e-4
"""By how much the least stiffness may be missed [N m], a fiftieth of its default."""
TURNED = 1e-3
"""By how much the trace of the least cosine may be missed: 0.2 degrees at 10 degrees, 0.7 at 2."""
PRESS = 0.2
"""By how much a force may miss its bounds [N], a tenth of the paper's least force."""
BALANCE = 1e-3
"""Largest net force [N] and net torque [N m] along an axis that count as balanced."""
DEXTERITY = 0.01
"""By how much the log of the least manipulability may be missed: 1 % of it."""
STIFF = 1.0
"""By how much the least sum of gains may be missed [N/m]."""
DICTATED = 0.02
"""By how much k σ may miss the prescribed α [N]."""
