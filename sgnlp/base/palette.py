"""The colours of all pictures. Each finger has the same colour in pages, reports and simulations.

They are from the palette of Okabe and Ito (Color Universal Design, 2008), which is distinct for all kinds of colour
vision. Its greens and yellow are not used, because the surface shows its deviation in viridis.
"""

from collections.abc import Sequence

Colour = tuple[float, float, float]

BLUE, ORANGE, PURPLE, VERMILION, SKY = (
    (0.0, 0.447, 0.698),
    (0.902, 0.624, 0.0),
    (0.8, 0.475, 0.655),
    (0.835, 0.369, 0.0),
    (0.337, 0.706, 0.914),
)
FINGERS: tuple[Colour, ...] = (BLUE, ORANGE, PURPLE, VERMILION, SKY)
"""The colours of the fingers in their order; they repeat after the fifth."""
INK, GREY, STONE, PALE = (0.1, 0.1, 0.1), (0.45, 0.45, 0.47), (0.62, 0.64, 0.66), (0.9, 0.89, 0.87)
"""Colours of points and texts; of parts without a colour; of the whole hand in a legend; of the table."""
RED, GREEN = (0.85, 0.1, 0.1), (0.1, 0.6, 0.15)
"""Colours of regions to avoid, and of regions to touch."""
AXES: dict[str, Colour] = {"x": RED, "y": GREEN, "z": (0.1, 0.25, 0.9)}
"""The axes of a frame, coloured as in RViz and in Pinocchio's viewers."""
LUMA = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue in the lightness (ITU-R BT.709)."""
LIGHTEST_DARK = 0.7
"""Least lightness of a link of the hand. Darker links would hide what is behind them."""


def finger(index: int) -> Colour:
    """The colour of a finger by its index in the hand."""
    return FINGERS[index % len(FINGERS)]


def lightened(colour: Sequence[float]) -> Colour:
    """A colour mixed with white until its lightness Σ w c is `LIGHTEST_DARK`; lighter colours do not change."""
    red, green, blue = colour
    lightness = sum(w * c for w, c in zip(LUMA, (red, green, blue), strict=True))
    white = max(0.0, (LIGHTEST_DARK - lightness) / (1 - lightness)) if lightness < 1 else 0.0
    return tuple(c + white * (1 - c) for c in (red, green, blue))  # type: ignore[return-value]


def css(colour: Colour) -> str:
    """The colour as #rrggbb."""
    return "#" + "".join(f"{round(255 * c):02x}" for c in colour)
