"""Scores of probabilities, against examples worked out by hand and against pairs counted one by one."""

from itertools import product
from math import isnan, log

import numpy as np
import pytest

from sgnlp.experiments.reliability import Bin, area, bins, brier, log_loss

P = np.array([0.9, 0.2, 0.6, 0.8, 0.4])
HELD = np.array([True, False, False, True, True])


def test_bins_hold_as_many_each_the_lowest_first():
    found = list(bins(P, HELD, 2))
    assert found[0] == Bin(3, 0.2, 0.6, pytest.approx(0.4), 1)
    assert found[1] == Bin(2, 0.8, 0.9, pytest.approx(0.85), 2)


def test_few_probabilities_have_few_bins():
    assert [b.number for b in bins(P[:2], HELD[:2], 5)] == [1, 1]


def test_the_brier_score_is_the_mean_square():
    assert brier(P, HELD) == pytest.approx((0.01 + 0.04 + 0.36 + 0.04 + 0.36) / 5)
    assert brier(np.full(5, 0.5), HELD) == 0.25


def test_the_log_loss_is_that_of_what_came_true():
    assert log_loss(P, HELD) == pytest.approx(-(log(0.9) + log(0.8) + log(0.4) + log(0.8) + log(0.4)) / 5)


def test_the_area_is_the_share_of_pairs_in_the_right_order():
    rng = np.random.default_rng(0)
    p, held = rng.integers(0, 6, 40) / 6, rng.random(40) < 0.6
    pairs = [(a > b) + (a == b) / 2 for a, b in product(p[held], p[~held])]
    assert area(p, held) == pytest.approx(np.mean(pairs))
    assert area(P, HELD) == pytest.approx(5 / 6)


def test_there_is_no_area_where_all_ended_alike():
    assert isnan(area(P, np.ones(5, bool)))
    assert isnan(area(P, np.zeros(5, bool)))
