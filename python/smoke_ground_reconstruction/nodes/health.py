"""What a node tells /diagnostics of itself, as the nodelets do."""

import threading
import time

from diagnostic_msgs.msg import DiagnosticStatus

_LONG = 5.0  # without a scan, at which something is amiss [s]


class StageHealth:
    """Input rate, points in and kept, last processing time, last drop, and what the last scan
    showed; any thread may call.

    Parameters
    ----------
    input_topic : str
        What ~input is called outside.
    """

    def __init__(self, input_topic: str):
        self._lock = threading.Lock()
        self._input = input_topic
        self._is_listening = False
        self._last_arrival = -_LONG
        self._last_news = 0.0  # a scan done or dropped, or the first listener
        self._since = time.monotonic()
        self._recent = {"arrived": 0, "done": 0, "dropped": 0}
        self._total = dict(self._recent)
        self._points = (0, 0)
        self._milliseconds = 0.0
        self._last_drop = "none"
        self._findings, self._warning = {}, ""

    def set_listening(self, listening: bool) -> None:
        """Does anybody listen to an output?"""
        with self._lock:
            self._is_listening = listening
            self._last_news = time.monotonic()

    def input_arrived(self) -> None:
        """A message came in on ~input."""
        with self._lock:
            self._count("arrived")
            self._last_arrival = time.monotonic()

    def scan_done(self, points_in: int, points_kept: int, milliseconds: float) -> None:
        """A scan went through."""
        with self._lock:
            self._count("done")
            self._last_news = time.monotonic()
            self._points = (points_in, points_kept)
            self._milliseconds = milliseconds

    def scan_dropped(self, reason: str) -> None:
        """A scan did not."""
        with self._lock:
            self._count("dropped")
            self._last_news = time.monotonic()
            self._last_drop = reason

    def tell(self, findings, warning="") -> None:
        """What the last scan showed, texts by name, and what is to be warned of."""
        with self._lock:
            self._findings, self._warning = dict(findings), warning

    def report(self, status):
        """Fill in the state since the last report and return it."""
        with self._lock:
            now = time.monotonic()
            rate = self._recent["arrived"] / max(now - self._since, 1e-9)
            status.summary(*self._summary())
            status.add("input rate [Hz]", f"{rate:g}")
            status.add("points in", str(self._points[0]))
            status.add("points kept", str(self._points[1]))
            status.add("last processing time [ms]", f"{self._milliseconds:g}")
            status.add("scans done", str(self._total["done"]))
            status.add("scans dropped", str(self._total["dropped"]))
            status.add("last drop", self._last_drop)
            for name, value in self._findings.items():
                status.add(name, value)
            self._since = now
            self._recent = dict.fromkeys(self._recent, 0)
        return status

    def _count(self, what):
        self._recent[what] += 1
        self._total[what] += 1

    def _summary(self):
        if not self._is_listening:
            return DiagnosticStatus.OK, "idle: nobody listens"
        if self._recent["dropped"]:
            return DiagnosticStatus.WARN, f"dropped a scan: {self._last_drop}"
        if self._recent["done"] and self._warning:
            return DiagnosticStatus.WARN, self._warning
        if self._recent["done"]:
            return DiagnosticStatus.OK, "running"
        return DiagnosticStatus.WARN, self._what_fails_to_come(self._recent["arrived"] > 0)

    def standstill(self) -> str:
        """What fails to come, where the node listens and for long no scan went through or was
        dropped; else empty."""
        with self._lock:
            now = time.monotonic()
            if not self._is_listening or now - self._last_news < _LONG:
                return ""
            return self._what_fails_to_come(now - self._last_arrival < _LONG)

    def _what_fails_to_come(self, comes_in):
        if not comes_in:
            return f"no cloud comes on {self._input}"
        return f"clouds come on {self._input}, but none of their stamps on both ~ground and ~walls"
