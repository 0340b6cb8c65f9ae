"""Masks: which pixels are the object's, for every way in which people save one, and a refusal where it is open."""

import io

import numpy as np
import pytest
from PIL import Image, ImageFilter

from sgnlp.base.errors import InputError
from sgnlp.perception.masks import flat, marked

v, u = np.indices((60, 80))
DISC = (v - 30) ** 2 + (u - 40) ** 2 < 15**2
GREY = np.where(DISC, 255, 0).astype(np.uint8)
OPAQUE = np.full_like(GREY, 255)
LABELS = np.where(DISC, 5, np.where(v > 50, 3, 0)).astype(np.uint8)
PHOTO = np.asarray(
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (6, 8, 3), np.uint8)).resize((80, 60), Image.BICUBIC)
)


def jpeg(pixels: np.ndarray, quality: int = 75) -> np.ndarray:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=quality)
    return np.asarray(Image.open(stream))


def blurred(radius: float) -> np.ndarray:
    return np.asarray(Image.fromarray(GREY).filter(ImageFilter.GaussianBlur(radius)))


@pytest.mark.parametrize(
    "mask",
    [DISC, GREY, DISC.astype(np.uint8), DISC.astype(np.uint16) * 65535, DISC.astype(float), -1.0 * DISC, 7 * DISC],
)
def test_two_values_are_the_object_and_the_rest(mask):
    found, notes = marked(mask)
    np.testing.assert_array_equal(found, DISC)
    assert notes == []


@pytest.mark.parametrize("mask", [jpeg(GREY), jpeg(GREY, 20), blurred(1), blurred(3), blurred(3) / 255.0])
def test_soft_edges_are_cut_at_half_and_noted(mask):
    found, notes = marked(mask)
    assert (found ^ DISC).sum() < 0.1 * DISC.sum()
    assert "soft edges" in notes[0]


def test_labels_need_a_choice():
    with pytest.raises(InputError, match=r"several labels; choose with --label .*: 0 \(\d+ px\), 3 .*, 5 \(\d+ px\)"):
        marked(LABELS)
    found, notes = marked(LABELS, 5)
    np.testing.assert_array_equal(found, DISC)
    assert notes == []
    with pytest.raises(InputError, match=r"no pixel of the mask has the label 4; its values: 0 .* 3 .* 5"):
        marked(LABELS, 4)


@pytest.mark.parametrize(
    "mask",
    [
        np.where(v < 2, 255, LABELS),  # a rim that is to be ignored
        np.where(LABELS == 5, 25001, 0) + np.where(LABELS == 3, 26001, 0),
        np.where(DISC, 255, np.where(np.roll(DISC, 6, 1), 128, 0)),
        (u // 4) * (v > 20),  # 20 labels
    ],
)
def test_areas_of_middle_values_are_labels(mask):
    with pytest.raises(InputError, match="several labels"):
        marked(mask)


@pytest.mark.parametrize("mask", [DISC + 1, np.where(DISC, 1, -1), np.where(DISC, 253, 84)])
def test_two_values_without_0_need_a_choice(mask):
    with pytest.raises(InputError, match="no 0, which marks what is not the object"):
        marked(mask)


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        (np.where(DISC, 1.0, np.nan), "holds NaN"),
        (PHOTO[..., 0], "the mask is a picture"),
        (GREY[0], "must be an array of numbers"),
        (np.array([["a"]]), "must be an array of numbers"),
    ],
)
def test_what_is_no_mask_is_refused(mask, message):
    with pytest.raises(InputError, match=message):
        marked(mask)


@pytest.mark.parametrize(
    ("pixels", "note"),
    [
        (np.dstack([GREY, GREY, GREY, OPAQUE]), "Ignored the alpha channel"),
        (np.dstack([GREY, OPAQUE]), "Ignored the alpha channel"),
        (np.dstack([GREY, GREY, GREY, GREY // 2 + 100]), "Ignored the alpha channel"),
        (np.dstack([OPAQUE, OPAQUE, OPAQUE, GREY]), "Took the alpha channel"),
        (np.dstack([0 * GREY, GREY]), "Took the alpha channel"),
        (np.dstack([PHOTO, GREY]), "Took the alpha channel"),
    ],
)
def test_alpha_is_the_mask_only_where_colours_are_none(pixels, note):
    found, notes = flat(pixels)
    np.testing.assert_array_equal(found > 0, DISC)
    assert notes[0].startswith(note)


@pytest.mark.parametrize(
    "pixels",
    [np.dstack([GREY] * 3), np.dstack([GREY, 0 * GREY, GREY]), np.dstack([DISC] * 3), DISC[None], DISC[..., None]],
)
def test_black_and_one_colour_are_a_mask(pixels):
    found, notes = flat(pixels)
    np.testing.assert_array_equal(found > 0, DISC)
    assert notes == []


def test_a_coloured_jpeg_is_a_mask_with_soft_edges():
    found, notes = marked(flat(jpeg(np.dstack([GREY, 0 * GREY, 0 * GREY]), 90))[0])
    assert (found ^ DISC).sum() < 0.05 * DISC.sum()
    assert "soft edges" in notes[0]


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (np.dstack([GREY, np.where(v > 50, 255, 0), 0 * GREY]), "several colours"),
        (PHOTO, "several colours"),
        (np.zeros((9, 3, 7), np.uint8), "an image of 1 to 4 channels"),
        (np.stack([DISC] * 3), r"3 masks of .* pixels: save one of them, such as mask\[0\]"),
    ],
)
def test_colours_of_several_things_are_refused(pixels, message):
    with pytest.raises(InputError, match=message):
        flat(pixels)
