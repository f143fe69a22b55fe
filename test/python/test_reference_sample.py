"""Samples of lists."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.sample import sample


@pytest.mark.parametrize("size", [0, 1, 1999])
def test_short_lists_are_taken_whole(size):
    np.testing.assert_array_equal(sample(size, 1000), np.arange(size))


@pytest.mark.parametrize("size", [2000, 40_000, 115_207])
def test_one_of_each_row_is_taken(size):
    taken = sample(size, 1000)
    stride = size // 1000
    np.testing.assert_array_equal(taken // stride, np.arange(size // stride))
    assert 1000 <= len(taken) < 2000


def test_no_ring_is_preferred():
    # 128 rings fire in turn: a stride of 16 alone would hit eight of them.
    ring = sample(128 * 512, 4096) % 128
    assert np.bincount(ring, minlength=128).min() > 10


def test_nothing_is_asked_for():
    np.testing.assert_array_equal(sample(3, 0), [0])
