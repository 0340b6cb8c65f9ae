"""Reads the object's pixels from a mask image: grey, coloured, with alpha, with labels, or with soft edges."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sgnlp.base.arrays import Array, BoolArray
from sgnlp.base.errors import InputError

Pixels = NDArray[Any]

MIDDLE = (0.1, 0.9)
"""Share of the range of grey values beyond the ripples of a JPEG, which are at most about 20 of 255."""
FEW_VALUES = 16
"""Label images rarely have more values; masks with soft edges and even areas, such as JPEGs, have more."""
PLATEAU = 3
"""[px] Side of the smallest even area: soft edges have none."""
PLATEAU_SHARE = 0.01
"""Share of the bright pixels that must be even and of middle grey for labels in an image of many values."""
PHOTO_SHARE = 0.25
"""Largest share of middle grey in a mask: an edge 8 px wide around a can that fills half of the image has 0.13."""
SAME_COLOUR = 0.25
"""Largest difference of a channel, as a share of the brightest, between pixels of one colour; JPEG blurs colours."""
LISTED = 10
"""Most labels that a refusal lists."""


def marked(mask: ArrayLike, label: int | None = None) -> tuple[BoolArray, list[str]]:
    """The pixels (height, width) that a mask marks, and a note on what was assumed.

    Without `label` these are the pixels that are not 0; soft edges are cut at the middle of the range. With it, these
    are the pixels with that value. Raises `InputError` if several labels, or no 0, leave the object unclear.
    """
    values = np.asarray(mask)
    if values.dtype.kind not in "biuf" or values.ndim != 2 or values.size == 0:
        raise InputError(f"the mask must be an array of numbers (height, width); found {values.dtype} {values.shape}")
    if not np.isfinite(values).all():
        raise InputError("the mask holds NaN or infinite values; give 1 where the object is and 0 elsewhere")
    there, counts = np.unique(values, return_counts=True)
    listed = ", ".join(f"{v:g} ({n} px)" for v, n in list(zip(there, counts, strict=True))[:LISTED])
    listed += ", ..." if len(there) > LISTED else ""
    if label is not None:
        if label not in there:
            raise InputError(f"no pixel of the mask has the label {label}; its values: {listed}")
        return values == label, []
    if len(there) == 1 or (len(there) == 2 and 0 in there):
        return values != 0, []
    if len(there) == 2 or _labels(values, len(there)):
        fault = "several labels" if 0 in there else "no 0, which marks what is not the object"
        raise InputError(f"the mask has {fault}; choose with --label (in Python: mask == label): {listed}")
    return _hard(values.astype(np.float64))


def _labels(values: Pixels, count: int) -> bool:
    """Whether values between the lowest and the highest fill areas, as labels do and soft edges do not."""
    from scipy.ndimage import maximum_filter, minimum_filter

    low, high = float(values.min()), float(values.max())
    even = maximum_filter(values, PLATEAU) == minimum_filter(values, PLATEAU)
    if count <= FEW_VALUES:
        return bool((even & (values != low) & (values != high)).any())
    middle = (values > low + MIDDLE[0] * (high - low)) & (values < low + MIDDLE[1] * (high - low))
    return bool((even & middle).sum() > PLATEAU_SHARE * (values > low).sum())


def _hard(values: Array) -> tuple[BoolArray, list[str]]:
    """The pixels above the middle of the range, and a note on soft edges."""
    low, high = values.min(), values.max()
    bounds = [low + share * (high - low) for share in MIDDLE]
    soft = int(((values > bounds[0]) & (values < bounds[1])).sum())
    if low < 0:
        raise InputError(
            f"the mask has values from {low:.3g} to {high:.3g}: if they are the scores of a network, give "
            "where they are above its threshold (mask > 0 for logits)"
        )
    if low > MIDDLE[0] * (high - low) or soft > PHOTO_SHARE * values.size:
        raise InputError(
            f"the mask is a picture, {soft} of its {values.size} pixels neither dark nor bright; "
            "give one that is black where the object is not and white where it is"
        )
    cut = (low + high) / 2
    return values >= cut, [f"The mask has soft edges, values from {low:g} to {high:g}: took those of at least {cut:g}."]


def flat(pixels: ArrayLike) -> tuple[Pixels, list[str]]:
    """One value for each pixel (height, width) of an image (height, width, channels), and notes on what was ignored.

    Alpha is ignored, unless only alpha can be the mask. Colours become their brightest channel. Raises `InputError`
    for several colours.
    """
    values = np.asarray(pixels)
    if values.ndim == 3 and 1 in values.shape:
        values = values.squeeze(axis=values.shape.index(1))
    if values.ndim == 2:
        return values, []
    if values.ndim == 3 and values.shape[0] < min(values.shape[1:]):
        shape = f"{len(values)} masks of {values.shape[1]} x {values.shape[2]} pixels"
        raise InputError(f"the mask is of shape {values.shape}, {shape}: save one of them, such as mask[0]")
    if values.dtype == np.bool_:
        values = values.astype(np.uint8)
    if values.ndim != 3 or values.shape[2] not in (2, 3, 4) or values.dtype.kind not in "iu":
        raise InputError(f"the mask must be an image of 1 to 4 channels; found {values.dtype} of shape {values.shape}")
    if values.shape[2] == 3:
        return _brightest(values), []
    colours, alpha = values[..., :-1], values[..., -1]
    if (alpha == alpha.flat[0]).all():
        return _brightest(colours), ["Ignored the alpha channel of the mask, which is the same everywhere."]
    if _black_and_one(colours):
        return _brightest(colours), ["Ignored the alpha channel of the mask: its colours are black and one other."]
    return alpha, ["Took the alpha channel as the mask: its colours are not black and one other."]


def _black_and_one(colours: Pixels) -> bool:
    lit = colours.any(axis=2)
    return bool(lit.any() and not lit.all() and (colours[lit] == colours[lit][0]).all())


def _brightest(colours: Pixels) -> Pixels:
    """The brightest channel of an image of black and one colour, whose edges may be soft."""
    grey = colours.max(axis=2)
    if colours.shape[2] == 1 or (colours == grey[..., None]).all():
        return grey
    bright = colours[grey >= grey.max() / 2].astype(np.float64)
    hues = bright / bright.max(axis=1, keepdims=True)
    if (np.abs(hues - np.median(hues, axis=0)) > SAME_COLOUR).any(axis=1).mean() > PLATEAU_SHARE:
        raise InputError("the mask has several colours; save it with the object white and the rest black, or as labels")
    return grey
