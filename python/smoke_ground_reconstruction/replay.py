"""Plays a bag through the nodelets and records what they publish, on a ROS master of its own.

Every wait is for a condition: the nodelets answer, the chain listens, the last scan came out.
"""

import contextlib
import os
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
from typing import Any, Callable, Dict, Iterable, Iterator, List, Set

import rosbag
import rosgraph
import rospy
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from smoke_ground_reconstruction.console import CommandError
from smoke_ground_reconstruction.io import replacing
from smoke_ground_reconstruction.io.bag import BOUNDARY, NAMESPACE, SURFACE, WALLS, Scans
from smoke_ground_reconstruction.msg import FloorBoundary

OUTPUTS = {
    "denoiser/denoised": PointCloud2,
    "denoiser/noise": PointCloud2,
    "segmenter/ground": PointCloud2,
    WALLS: PointCloud2,
    SURFACE: PointCloud2,
    "reconstructor/occupancy": OccupancyGrid,
    BOUNDARY: FloorBoundary,
    "reconstructor/boundary_polygon": PolygonStamped,
    "reconstructor/markers": MarkerArray,
}

# room_boundary takes the raw scan alone: to listen to the other stages would only wake them.
_OF_RECONSTRUCTOR = {n: kind for n, kind in OUTPUTS.items() if n.startswith("reconstructor/")}

_START_DEADLINE = 60.0  # until the nodelets answer, and until they listen [s]
_SILENCE = 20.0  # after the last scan, without which nothing more is expected [s]
_POLL = 0.02  # between two looks at a condition [s]

# Entries of the master's state.
_SUBSCRIBED_TOPICS, _SERVICES = 1, 2


@contextlib.contextmanager
def own_master() -> Iterator[None]:
    """A place for a ROS master that meets no other one on this machine."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    changes = {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_HOSTNAME": "localhost"}
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


@contextlib.contextmanager
def nodelets(launch_arguments: Dict[str, Any]) -> Iterator[None]:
    """The three nodelets and their master, from launch/ground_reconstruction.launch, while inside.

    Raises
    ------
    CommandError : they do not answer in time; with what roslaunch last said.
    """
    port = os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1]
    command = ["roslaunch", "--port", port, "smoke_ground_reconstruction"]
    command.append("ground_reconstruction.launch")
    command += [f"{name}:={value}" for name, value in launch_arguments.items()]
    with tempfile.TemporaryFile("w+") as log, running(command, log) as process:
        if not _becomes_true(_nodelets_answer, _START_DEADLINE, process):
            log.seek(0)
            raise CommandError(f"the nodelets did not start; roslaunch said: {complaint(log)}")
        yield


def complaint(log: Iterable[str]) -> str:
    """What went wrong according to roslaunch's output: its first error and what follows, on one
    line; else the last thing it said."""
    plain = (re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in log)
    lines = [line for line in plain if line]
    errors = [i for i, line in enumerate(lines) if re.search("exception|error|fatal", line.lower())]
    start = errors[0] if errors else len(lines) - 1
    return " ".join(lines[max(start, 0) : start + 4]) or "nothing"


def record(scans: Scans, output: str, rate: float, method: str) -> int:
    """Plays scans to running nodelets and records all that those at work publish. Once a process:
    rospy joins one master only.

    Parameters
    ----------
    scans : the scans of a bag
    output : bag to write
    rate : speed of the playback; 1 is real time
    method : of the reconstruction, with which the nodelets were started

    Returns
    -------
    int : number of scans that came out as floors

    Raises
    ------
    CommandError : the nodelets do not listen, or no floor came out.
    """
    rospy.init_node("smoke_ground_replay", anonymous=True, disable_signals=True)
    command = ["rosbag", "play", "--quiet", "--wait-for-subscribers", f"--rate={rate}"]
    command += [scans.path, "--topics", scans.topic]
    with replacing(output) as part, rosbag.Bag(part, "w") as bag:
        is_room = method == "room_boundary"
        recorder = _Recorder(bag, _OF_RECONSTRUCTOR if is_room else OUTPUTS)
        wanted = {scans.topic} | (set() if is_room else _topics_between())
        listening = lambda: wanted <= _known_to_master(_SUBSCRIBED_TOPICS)  # noqa: E731
        if not _becomes_true(listening, _START_DEADLINE):
            raise CommandError("the nodelets do not listen to their input")
        with running(command, subprocess.DEVNULL) as player:
            recorder.wait_for_floors(len(scans), player)
        recorder.stop()
        if recorder.floors() == 0:
            raise CommandError("no floor came out of the nodelets")
        return recorder.floors()


class _Recorder:
    """Writes every message of some topics to a bag as it comes."""

    def __init__(self, bag: rosbag.Bag, outputs: Dict[str, Any]):
        self._bag = bag
        self._lock = threading.Lock()
        self._counts = dict.fromkeys(outputs, 0)
        self._last_news = time.monotonic()
        self._subscribers = [
            rospy.Subscriber(f"{NAMESPACE}/{topic}", kind, self._write, topic, queue_size=100)
            for topic, kind in outputs.items()
        ]

    def floors(self) -> int:
        """Scans of which every output has come."""
        with self._lock:
            return min(self._counts.values())

    def wait_for_floors(self, wanted: int, player: subprocess.Popen) -> None:
        """Waits until all are there, or nothing has come for long after the last scan was sent."""

        def is_over() -> bool:
            if player.poll() is None:
                self._last_news = time.monotonic()
            return self.floors() >= wanted or time.monotonic() - self._last_news > _SILENCE

        while not is_over():
            time.sleep(_POLL)

    def stop(self) -> None:
        """Takes no more messages."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        with self._lock:
            self._bag = None

    def _write(self, message, topic: str) -> None:
        with self._lock:
            if self._bag is None:
                return
            self._bag.write(f"{NAMESPACE}/{topic}", message, _stamp_of(message))
            self._counts[topic] += 1
            self._last_news = time.monotonic()


def _stamp_of(message) -> rospy.Time:
    return message.markers[0].header.stamp if hasattr(message, "markers") else message.header.stamp


@contextlib.contextmanager
def running(command: List[str], output) -> Iterator[subprocess.Popen]:
    """A process in a group of its own, ended on leaving: first asked, then told."""
    process = subprocess.Popen(
        command, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
    )
    try:
        yield process
    finally:
        for sign, patience in ((signal.SIGINT, 30), (signal.SIGTERM, 10), (signal.SIGKILL, 10)):
            if process.poll() is None:
                os.killpg(process.pid, sign)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(patience)


def _becomes_true(
    holds: Callable[[], bool], deadline: float, process: subprocess.Popen = None
) -> bool:
    """Waits until it holds; False at the deadline, or once the process has ended."""
    end = time.monotonic() + deadline
    while not holds():
        if time.monotonic() > end or (process is not None and process.poll() is not None):
            return False
        time.sleep(_POLL)
    return True


def _nodelets_answer() -> bool:
    """Have the three stages their services up?"""
    return {f"{name}/set_parameters" for name in _stages()} <= _known_to_master(_SERVICES)


def _topics_between() -> Set[str]:
    """What the stages subscribe to from one another."""
    denoiser, segmenter, _ = _stages()
    return {f"{denoiser}/denoised", f"{segmenter}/ground", f"{segmenter}/walls"}


def _stages() -> List[str]:
    return [f"{NAMESPACE}/{name}" for name in ("denoiser", "segmenter", "reconstructor")]


def _known_to_master(what: int) -> Set[str]:
    try:
        state = rosgraph.Master("/smoke_ground_replay").getSystemState()
    except (OSError, rosgraph.MasterException):
        return set()
    return {name for name, _ in state[what]}
