"""Intervals of counts."""

from math import comb

import pytest

from sgnlp.experiments.frames import percent, sign_test, wilson


def test_wilsons_interval_is_that_of_the_literature():
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)  # Newcombe 1998, table I
    assert wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0, 0.1611), abs=5e-5)
    assert wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=5e-5)


def test_all_and_none_mirror_each_other_and_nothing_tells_nothing():
    low, high = wilson(20, 20)
    assert (1 - high, 1 - low) == pytest.approx(wilson(0, 20))
    assert wilson(0, 0) == (0, 1)
    assert percent(0, 0) == "-"


def test_the_interval_holds_the_truth_as_often_as_it_promises_on_the_mean():
    n, shares = 40, [i / 50 for i in range(5, 46)]
    inside = [
        sum(comb(n, k) * p**k * (1 - p) ** (n - k) for k in range(n + 1) if wilson(k, n)[0] <= p <= wilson(k, n)[1])
        for p in shares
    ]
    assert sum(inside) / len(inside) == pytest.approx(0.95, abs=0.01)


def test_a_share_is_told_with_its_interval():
    assert percent(81, 263) == "31 (26-37)"


@pytest.mark.parametrize(("better", "worse"), [(13, 2), (2, 13), (5, 5), (0, 6), (7, 0)])
def test_the_sign_test_counts_the_splits_that_are_as_uneven(better, worse):
    n = better + worse
    splits = [comb(n, k) for k in range(n + 1) if abs(2 * k - n) >= abs(better - worse)]
    assert sign_test(better, worse) == pytest.approx(sum(splits) / 2**n)


def test_without_a_pair_that_differs_nothing_is_told_apart():
    assert sign_test(0, 0) == 1


@pytest.mark.parametrize("n", range(1, 41))
def test_a_share_is_within_its_interval_to_the_last_digit(n):
    for k in range(n + 1):
        low, high = wilson(k, n)
        assert low <= k / n <= high
