"""Writes msg/Timing.msg while a scan is worked on."""

import time

import numpy as np

from smoke_ground_reconstruction.msg import Timing

from ..reference.visibility import UNKNOWN


class StageTiming:
    """The timing of one scan; ``message`` is what goes out."""

    def __init__(self, header):
        self.message = Timing(header=header, begun=time.monotonic_ns())
        self.told(UNKNOWN)
        self._begin = time.perf_counter()

    def received(self, cloud) -> None:
        """Note where the data of a received cloud lies."""
        self.message.input_buffers.append(_address_of(cloud))

    def hands_over(self, cloud) -> None:
        """Note where the data of a cloud lies that is handed over now; None: nobody listens."""
        self.message.output_buffers.append(0 if cloud is None else _address_of(cloud))
        self.message.handed_over.append(0 if cloud is None else time.monotonic_ns())

    def finish(self, stage: str, points_in: int, points_out: int) -> None:
        """End a stage that began where the one before ended."""
        now = time.perf_counter()
        self.message.stages.append(stage)
        self.message.milliseconds.append((now - self._begin) * 1e3)
        self.message.points_in.append(points_in)
        self.message.points_out.append(points_out)
        self._begin = now

    def told(self, visibility) -> None:
        """Note how far the sensor sees, a reference.visibility.Visibility."""
        self.message.extinction = visibility.extinction
        self.message.extinction_sigma = visibility.sigma

    def milliseconds(self) -> float:
        """Sum over the stages."""
        return sum(self.message.milliseconds)


def _address_of(cloud):
    return np.frombuffer(cloud.data, np.uint8).ctypes.data if len(cloud.data) > 0 else 0
