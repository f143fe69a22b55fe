"""What a stage says of one input point."""

from enum import IntEnum

import numpy as np


class Label(IntEnum):
    """Label of a point; stored as uint8."""

    INVALID = 0  #: non-finite, or the zero point that drivers send where nothing returned
    KEPT = 1  #: survived denoising; in the segmenter's answer: neither ground nor wall
    NOISE = 2  #: removed by the denoiser
    GROUND = 3
    WALL = 4


#: Cluster number (uint32) of a point that belongs to no cluster.
NO_CLUSTER = np.uint32(0xFFFFFFFF)
