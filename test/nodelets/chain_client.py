"""What the tests of the nodelets share: listeners that wait for a stamp, and a chain to ask."""

import threading
import time
import unittest

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import OccupancyGrid
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from smoke_ground_reconstruction.msg import FloorBoundary, Timing
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

NS = "/ground_reconstruction"
CLOUD = "/cloud"
DEADLINE = 60.0  # [s]; of a condition, generous because machines may be busy
TYPES = {
    "denoiser/denoised": PointCloud2,
    "denoiser/noise": PointCloud2,
    "denoiser/timing": Timing,
    "reader/denoised": PointCloud2,
    "reader/noise": PointCloud2,
    "segmenter/ground": PointCloud2,
    "segmenter/walls": PointCloud2,
    "segmenter/timing": Timing,
    "reconstructor/ground_surface": PointCloud2,
    "reconstructor/occupancy": OccupancyGrid,
    "reconstructor/boundary": FloorBoundary,
    "reconstructor/boundary_polygon": PolygonStamped,
    "reconstructor/markers": MarkerArray,
    "reconstructor/timing": Timing,
}


def wait_until(condition, what, deadline=DEADLINE):
    """Wait for a condition; its value is returned. AssertionError at the deadline."""
    end = time.monotonic() + deadline
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end or rospy.is_shutdown():
            raise AssertionError(f"waited {deadline:g} s in vain for {what}")
        time.sleep(0.005)  # between two looks at the condition


class Listener:
    """Keeps what a topic brings, by stamp."""

    def __init__(self, topic):
        self.topic = topic
        self.by_stamp = {}
        self._lock = threading.Lock()
        self._sub = rospy.Subscriber(f"{NS}/{topic}", TYPES[topic], self._take, queue_size=100)

    def _take(self, message):
        stamped = message.markers[0] if isinstance(message, MarkerArray) else message
        with self._lock:
            self.by_stamp.setdefault(stamped.header.stamp.to_nsec(), []).append(message)

    def wait(self, stamp, deadline=DEADLINE):
        """The message of a stamp."""
        what = f"{self.topic} at {stamp}"
        return wait_until(lambda: self.by_stamp.get(stamp.to_nsec()), what, deadline)[0]

    def has(self, stamp):
        """Has the message of a stamp come?"""
        return stamp.to_nsec() in self.by_stamp

    def is_connected(self):
        """Is there a publisher at the other end?"""
        return self._sub.get_num_connections() > 0

    def close(self):
        """Listen no more."""
        self._sub.unregister()


class Diagnostics:
    """The latest status of each node of the chain."""

    def __init__(self):
        self.latest = {}
        self.counts = {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._take, queue_size=100)

    def _take(self, array):
        for status in array.status:
            node = status.name.split(":")[0].split("/")[-1]
            self.counts[node] = self.counts.get(node, 0) + 1
            self.latest[node] = status

    def wait(self, node, condition, what):
        """The first status from now on that meets a condition."""
        seen = self.counts.get(node, 0)

        def fresh():
            status = self.latest.get(node)
            is_fresh = status is not None and self.counts[node] > seen
            return status if is_fresh and condition(status) else None

        return wait_until(fresh, f"{what} on /diagnostics of {node}")


def values_of(status):
    """The key-value pairs of a diagnostic status."""
    return {pair.key: pair.value for pair in status.values}


class ChainTestCase(unittest.TestCase):
    """A test that publishes scans on /cloud and listens to the chain."""

    @classmethod
    def setUpClass(cls):
        cls.cloud_pub = rospy.Publisher(CLOUD, PointCloud2, queue_size=10)
        cls.diagnostics = Diagnostics()
        cls._count = 0

    def setUp(self):
        self._listeners = []

    def tearDown(self):
        for listener in self._listeners:
            listener.close()

    def listen(self, *topics):
        """Connected listeners to topics of the chain."""
        listeners = [Listener(topic) for topic in topics]
        self._listeners += listeners
        for listener in listeners:
            wait_until(listener.is_connected, f"a publisher of {listener.topic}")
        return listeners if len(listeners) > 1 else listeners[0]

    @classmethod
    def next_header(cls, frame_id):
        """A header of its own stamp, with nanoseconds that a double would round off."""
        cls._count += 1
        return Header(stamp=rospy.Time(1_600_000_000 + cls._count, 123_456_789), frame_id=frame_id)

    def publish(self, make_cloud, frame_id="lidar"):
        """Publish ``make_cloud(header)`` and return its stamp."""
        cloud = make_cloud(self.next_header(frame_id))
        self.cloud_pub.publish(cloud)
        return cloud.header.stamp

    def wake(self, make_cloud, *listeners):
        """Publish scans until each listener has got an answer to one of them: all is connected."""
        patience = 0.5  # [s]; doubled, because a busy machine may take long for a scan

        def answered():
            nonlocal patience
            stamp = self.publish(make_cloud)
            patience *= 2
            try:
                for listener in listeners:
                    listener.wait(stamp, deadline=patience)
            except AssertionError:
                return False
            return True

        wait_until(answered, "an answer to a scan")

    def check_told_once(self, room_cloud):
        """Clouds that the awake denoiser drops are told of once, with its name and its topic."""
        lines = []
        log = rospy.Subscriber("/rosout", Log, lambda line: lines.append(line.msg))
        tellers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])["/rosout"]
        wait_until(lambda: log.get_num_connections() >= len(tellers), "all that is told")

        def dropped(status):
            return int(values_of(status)["scans dropped"])

        def drop_one(field):
            def broken(header):
                cloud = room_cloud(header)
                cloud.fields[field].datatype = 78
                return cloud

            before = dropped(self.diagnostics.wait("denoiser", lambda _: True, "anything"))
            self.publish(broken)
            self.diagnostics.wait("denoiser", lambda s: dropped(s) > before, "a dropped scan")

        def told_of(field):
            return [line for line in lines if f"field '{field}' has unknown datatype 78" in line]

        for field in (0, 0, 0, 1):  # the last one comes after all that is told of the first
            drop_one(field)
        wait_until(lambda: told_of("y"), "a line on the second fault")
        log.unregister()
        (line,) = told_of("x")
        start = f"{NS}/denoiser: dropped a scan of {CLOUD} (frame 'lidar'): "
        self.assertTrue(line.startswith(start), line)

    def ask(self, make_cloud, *listeners, **options):
        """The answers of a chain that is awake to one scan."""
        stamp = self.publish(make_cloud, **options)
        return [listener.wait(stamp) for listener in listeners]
