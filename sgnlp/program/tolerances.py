"""Tolerances: largest violations of the exact rows of a feasible grasp, each with its reason."""

ROUNDING = 1e-6
"""Of rows that a solver meets to 1e-8: margins [1], shares of the effort [1], the surface model's ball [m]."""
REACHED = 1e-4
"""Largest distance of the tips from the planned contacts at the joints of first contact [m]."""
CONTACT = 2e-3
"""Largest |distance| of a pad to the surface that counts as contact [m]."""
CLEARANCE = 1e-3
"""Largest violation of a clearance [m]: the surface itself is known no better."""
STABLE = 1e-4
"""Largest violation of the least stiffness [N m], a fiftieth of its default."""
TURNED = 1e-3
"""Largest violation of the least trace of the rotation: 0.2 degrees at 10 degrees, 0.7 at 2."""
PRESS = 0.2
"""Largest violation of a force's bounds [N], a tenth of the paper's least force."""
BALANCE = 1e-3
"""Largest net force [N] and net torque [N m] along an axis that count as balanced."""
DEXTERITY = 0.01
"""Largest violation of the log of the least manipulability: 1 % of the manipulability."""
STIFF = 1.0
"""Largest violation of the least sum of gains [N/m]."""
DICTATED = 0.02
"""Largest deviation of k σ from the prescribed α [N]."""
