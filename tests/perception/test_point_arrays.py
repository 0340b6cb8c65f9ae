"""Points as people keep them: the names of fields and columns decide, hidden entries are not measured."""

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception.observation import load
from sgnlp.perception.point_arrays import rows

P = np.random.default_rng(0).uniform(0.05, 0.15, (60, 3)).round(5)


class Table(dict):
    """A table of named columns, such as that of pandas."""

    @property
    def columns(self):
        return list(self)

    def __array__(self, dtype=None, copy=None):
        return np.stack(list(self.values()), axis=1)


class OnDevice:
    def __array__(self, dtype=None, copy=None):
        raise TypeError("can't convert cuda:0 device type tensor to numpy")


class Cloud:
    points = P


@pytest.mark.parametrize("names", ["zyx", "ZYX", ("pos_z", "pos_y", "pos_x"), "zygx"])
def test_the_names_of_columns_and_fields_decide_and_not_their_order(names):
    values = [P[:, "xyz".index(name[-1].lower())] if name != "g" else P[:, 0] for name in names]
    np.testing.assert_array_equal(rows(Table(zip(names, values, strict=True)), "points")[0], P)
    records = np.rec.fromarrays(values, names=list(names))
    np.testing.assert_array_equal(rows(records, "points")[0], P)


def test_columns_without_names_are_taken_in_their_order():
    np.testing.assert_array_equal(rows(Table(zip(range(3), P.T, strict=True)), "points")[0], P)


def test_what_a_masked_array_hides_is_not_measured():
    found = rows(np.ma.masked_less(P, 0.1), "points")[0]
    np.testing.assert_array_equal(found, np.where(P < 0.1, np.nan, P))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (OnDevice(), "'points' cannot be taken for an array; .* cuda:0"),
        (Cloud(), "'points' is a Cloud; give numpy.asarray of its points"),
        ("cloud.npz", "is a text; sgnlp.load"),
        (P.T.reshape(3, 6, 10), r"save points.reshape\(3, -1\).T"),
        (np.zeros(40, [("xyz", "f4", 3), ("rgb", "u1", 3)]), r"alone: points\['xyz'\]"),
    ],
)
def test_what_is_no_array_of_points_is_refused_with_what_to_give(value, message):
    with pytest.raises(InputError, match=message):
        rows(value, "points")


def test_a_number_may_be_an_array_of_one_and_separate_axes_are_told_how_to_join(tmp_path):
    np.savez(tmp_path / "one.npz", points=P, table_height=np.array([0.04]))
    assert load(tmp_path / "one.npz").table_height == 0.04
    np.savez(tmp_path / "axes.npz", x=P[:, 0], y=P[:, 1], z=P[:, 2])
    with pytest.raises(InputError, match=r"save points=np\.stack"):
        load(tmp_path / "axes.npz")
