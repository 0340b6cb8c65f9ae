"""Masks against what was measured: right ones give no note, and wrong ones are told, mended or refused."""

from functools import lru_cache

import numpy as np
import pytest
from scipy import ndimage
from tabletops import SMALL, Tabletop, random_bodies, seen, slab

from sgnlp.base.errors import InputError
from sgnlp.perception.depth import DepthImage, arrays
from sgnlp.perception.synthetic.meshes import box

EYES = ((-0.55, -0.1, 0.5), (0.5, -0.3, 0.4))


@lru_cache
def tables(kind: str = "one") -> tuple[Tabletop, ...]:
    """A table seen by two noisy cameras: with one box, with four bodies, or with a thin tray that has a rim."""
    rng = np.random.default_rng(3)
    rims = [slab((x, y, 0.04), (u, v, 0.02)) for x, y, u, v in
            ((0.2, 0.01, 0, 0.08), (0.2, 0.01, 0, -0.08), (0.01, 0.16, 0.1, 0), (0.01, 0.16, -0.1, 0))]  # fmt: skip
    bodies = {
        "one": [box([0.06, 0.08, 0.1]).standing(np.array([0.02, 0.01]))],
        "four": random_bodies(4, rng),
        "tray": rims,
        "stand": [slab((0.16, 0.16, 0.2), (0.0, 0.0, 0.1)), slab((0.06, 0.06, 0.1), (0.0, 0.0, 0.25))],
        "plate": [slab((0.3, 0.3, 0.2), (0.0, 0.0, 0.1)), slab((0.12, 0.12, 0.0025), (0.0, 0.0, 0.20125))],
    }
    return tuple(seen(bodies[kind], rng, eye=eye, camera=SMALL) for eye in EYES)


def notes(masks: list[np.ndarray], kind: str = "one", table: float | None = None) -> list[str]:
    """What is noted about masks (height, width) of the first images, but for the table's height."""
    images = [DepthImage(t.depth, m, t.camera.intrinsics, t.pose) for t, m in zip(tables(kind), masks, strict=False)]
    return [note for note in arrays(images, table)["notes"] if not note.startswith("Measured the table")]


def right(kind: str = "one", body: int = 1) -> list[np.ndarray]:
    return [table.labels == body for table in tables(kind)]


@pytest.mark.parametrize(("kind", "body"), [("one", 1), ("four", 1), ("four", 2), ("four", 3), ("four", 4)])
def test_right_masks_and_those_a_little_too_small_give_no_note(kind, body):
    masks = right(kind, body)
    assert notes(masks, kind) == []
    assert notes([ndimage.binary_erosion(mask, iterations=2) for mask in masks], kind) == []


@pytest.mark.parametrize("grown", [2, 5])
def test_the_pixels_of_the_table_in_a_mask_that_is_too_large_are_dropped_and_counted(grown):
    (image, *_), (mask, *_) = tables(), right()
    large = ndimage.binary_dilation(mask, iterations=grown)
    found = arrays([DepthImage(image.depth, large, image.camera.intrinsics, image.pose)])
    (said,) = (note for note in found["notes"] if "lie on the table" in note)
    true = image.image().points()[mask]
    away = np.abs(found["points"][:, None, :2] - true[None, np.isfinite(true[:, 2]), :2]).max(axis=2).min(axis=1)
    assert away.max() < 0.01  # nothing of the object's shadow is left
    dropped = np.isfinite(image.depth[large]).sum() - len(found["points"])
    assert said.startswith(f"Dropped {dropped} of {np.isfinite(image.depth[large]).sum()} marked pixels")
    assert found["table_height"] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("by", [(3, 0), (0, -3), (-6, 6)])
def test_a_mask_that_is_shifted_is_told(by):
    (said,) = notes([np.roll(right()[0], by, (0, 1))])
    assert "the mask is too large, shifted, or of another image" in said


def test_the_thin_floor_that_a_rim_encloses_is_kept():
    floor = ndimage.binary_fill_holes(tables("tray")[0].labels > 0)
    assert (floor & (tables("tray")[0].labels == 0)).sum() > 1000
    assert not [note for note in notes([floor], "tray") if "lie on the table" in note]


def test_a_mask_of_the_table_alone_is_told():
    beside = np.roll(right()[0], 60, axis=1)
    (said,) = notes([beside])
    assert "of the marked pixels lie at the table's height: the mask marks the table, or something too thin" in said


def test_a_mask_of_a_part_of_the_object_is_told():
    half = right()[0].copy()
    half[:, : int(np.median(np.nonzero(half)[1]))] = False
    (said,) = notes([half])
    assert said.startswith("The mask leaves out ")
    assert "of what joins its pixels without a step, more than 30%" in said


def test_the_floor_around_a_stand_is_no_table_where_the_table_is_given():
    found = notes(right("stand", 2), "stand", 0.2)
    assert not [note for note in found if "leaves out" in note or "lie on the table" in note]
    assert any("The mask leaves out" in note for note in notes(right("stand", 2), "stand"))


def test_right_masks_of_a_plate_too_thin_to_tell_from_its_table_are_not_called_swapped():
    for table in (None, 0.2):  # of the floor's pixels around it, or of the table alone
        assert notes(right("plate", 2), "plate", table)


def test_masks_of_each_others_images_are_refused_and_two_views_of_a_wrong_mask_are_not_called_so():
    one, two = right("four", 2)
    with pytest.raises(InputError, match=r"the masks of the images '0' and '1' are swapped: .*% of their pixels lie"):
        notes([two, one], "four")
    assert any("too large" in note for note in notes([ndimage.binary_dilation(m, iterations=9) for m in right()]))
