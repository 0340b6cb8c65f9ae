"""A kernel from outside the package, in both ways: the one of the documentation, and the same by four functions."""

from pathlib import Path
from typing import Any

import sgnlp

EXTENSION = sgnlp.extension(Path(__file__).parents[2] / "docs" / "examples" / "wendland.py")
Wendland = EXTENSION.additions().kernel


class WendlandInFull(sgnlp.Kernel):
    """Wendland's kernel with its radial derivatives by hand."""

    name = "wendland in full"

    def radial(self, r: Any) -> Any:
        R, s = self.support_radius, self.amplitude**2
        u, v = r / R, (r < R) * (1 - r / R)
        return (
            s * v**6 * (35 * u**2 + 18 * u + 3) / 3,
            -56 * s / (3 * R**2) * v**5 * (1 + 5 * u),
            560 * s / R**4 * v**4,
            -2240 * s / R**6 * v**3 / u,
        )
