"""Some of the entries of a list, for what a few thousand returns tell as well as all."""

import numpy as np

FEWEST = 4000  # entries, where the list has so many


def sample(size, fewest=FEWEST):
    """Places (S,) int64 of a sample of a list, ascending and evenly spread over it.

    One of each `stride` entries in a row, which of them a hash of the row's number says: rows and
    rings thus never keep step, and the same list has the same sample in both engines. A list of
    less than twice as many is taken whole.

    Parameters
    ----------
    size : int
        Of the list.
    fewest : int
        Entries of the sample, at least, if the list has as many.
    """
    stride = max(1, size // max(1, fewest))
    row = np.arange(size // stride)
    value = (row.astype(np.uint64) * 0x9E3779B1) & 0xFFFFFFFF
    value = ((value ^ (value >> 15)) * 0x85EBCA77) & 0xFFFFFFFF
    value ^= value >> 13
    return row * stride + ((value * stride) >> 32).astype(np.int64)
