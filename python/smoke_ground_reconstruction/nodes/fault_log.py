"""Tells of a fault when it begins, and not with each scan that has it; free of ROS."""

import re
import time

AWAY = 60.0  # so long a fault must be away to be news again [s]
_MOST = 32  # faults that are remembered


class FaultLog:
    """What was told of. Not for several threads at once."""

    def __init__(self):
        self._seen = {}  # at last [s], by text without digits

    def is_news(self, text: str, now=None) -> bool:
        """Is there to be told of a fault now?

        Parameters
        ----------
        text : str
            Of the fault; faults whose texts differ in digits alone are one.
        now : float, optional
            [s] of any clock that never goes back; the machine's, where none is given.
        """
        now = time.monotonic() if now is None else now
        fault = re.sub("[0-9]", "", text)
        last = self._seen.get(fault)
        if last is None and len(self._seen) == _MOST:
            self._seen.clear()
        self._seen[fault] = now
        return last is None or now - last > AWAY
