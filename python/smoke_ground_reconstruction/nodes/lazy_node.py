"""What the rospy nodes share: lazy inputs, tunable parameters, timing, diagnostics."""

import dataclasses
import threading
import time

import diagnostic_updater
import rospy
from dynamic_reconfigure.server import Server
from sensor_msgs.msg import PointCloud2

from smoke_ground_reconstruction.msg import Timing

from ..ros_messages import describe_fields
from .fault_log import FaultLog
from .health import StageHealth
from .strange_params import strange_params
from .timing import StageTiming

OUTPUT_QUEUE_SIZE = 2
# rospy reads a socket into a buffer of this size; smaller than a cloud, it makes scans queue up.
BUFFER_SIZE = 1 << 25


class LazyNode(rospy.SubscribeListener):
    """Listens to its inputs only while somebody listens to one of its outputs, or always where
    ~always_on is set. Bad input drops the scan, with a warning and a diagnostic.

    Parameters
    ----------
    params_class, config_class : type
        The stage's dataclass and the generated dynamic_reconfigure configuration, of equal names.
    """

    def __init__(self, params_class, config_class):
        super().__init__()
        self._input_topic = rospy.resolve_name("~input")
        self.health = StageHealth(self._input_topic)
        self._faults = FaultLog()
        self._lock = threading.RLock()
        self._outputs = []
        self._is_listening = False
        self._has_warned_of_rings = False
        self._queue_size = _queue_size()
        self._is_always_on = rospy.get_param("~always_on", False)
        self._params_class = params_class
        self.params = params_class()
        self._server = Server(config_class, self._on_config)
        self._warn_of_strange_params()
        self._timing_pub = rospy.Publisher("~timing", Timing, queue_size=OUTPUT_QUEUE_SIZE)
        threading.Thread(target=self._report, daemon=True).start()

    # --- what a node does ---

    def start_listening(self) -> None:
        """Subscribe to the inputs."""
        raise NotImplementedError

    def stop_listening(self) -> None:
        """Unsubscribe."""
        raise NotImplementedError

    def inputs_of(self, params):
        """What :meth:`start_listening` listens to with these parameters; it is called anew where
        a change of parameters changes this."""

    def repair(self, config) -> None:
        """Move what can be moved to the nearest allowed value; what stays wrong is refused."""

    # --- what it is given ---

    def advertise(self, topic: str, message_class) -> rospy.Publisher:
        """An output; its listeners wake the node once :meth:`start` has run."""
        publisher = rospy.Publisher(topic, message_class, self, queue_size=OUTPUT_QUEUE_SIZE)
        self._outputs.append(publisher)
        return publisher

    def start(self) -> None:
        """Every output is there: begin to listen where somebody does."""
        self._update_listening()

    def handle_scan(self, header, work) -> None:
        """Run ``work(timing) -> (points in, points kept)`` on one scan; time it and count it."""
        timing = StageTiming(header)
        try:
            points_in, points_kept = work(timing)
        except Exception as error:  # the node must outlive whatever a scan brings
            self.health.scan_dropped(str(error))
            self.warn(
                f"dropped a scan of {self._input_topic} (frame '{header.frame_id}'): {error}; "
                "/diagnostics counts further ones"
            )
            return
        self.health.scan_done(points_in, points_kept, timing.milliseconds())
        self._timing_pub.publish(timing.message)

    def warn(self, fault) -> None:
        """Warn of a fault, by the node's name, where FaultLog has it for news."""
        with self._lock:
            if self._faults.is_news(fault):
                rospy.logwarn(f"{rospy.get_name()}: {fault}")

    def warn_of_derived_rings(self, cloud) -> None:
        """Once in the life of the node."""
        if not self._has_warned_of_rings:
            self._has_warned_of_rings = True
            self.warn(
                f"clouds of {self._input_topic} have no 'ring'; rings are derived from elevation; "
                f"fields: {describe_fields(cloud)}"
            )

    # --- listeners ---

    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        """rospy's call: somebody listens."""
        self._update_listening()

    def peer_unsubscribe(self, topic_name, num_peers):
        """rospy's call: somebody listens no more."""
        self._update_listening()

    def _update_listening(self):
        with self._lock:
            is_heard = self._is_always_on or any(p.get_num_connections() for p in self._outputs)
            if is_heard == self._is_listening:
                return
            self._is_listening = is_heard
            self.health.set_listening(is_heard)
            if is_heard:
                self.start_listening()
            else:
                self.stop_listening()

    def subscribe(self, topic, callback) -> rospy.Subscriber:
        """A subscription to a PointCloud2 that keeps the newest ~queue_size scans: by default one,
        so that a stage that falls behind works on the newest, not on one that grew old in a
        queue."""
        return rospy.Subscriber(
            topic,
            PointCloud2,
            callback,
            queue_size=self._queue_size,
            buff_size=BUFFER_SIZE,
            tcp_nodelay=True,
        )

    # --- parameters and diagnostics ---

    def _warn_of_strange_params(self):
        tunable = [entry.name for entry in dataclasses.fields(self._params_class)]
        for name in strange_params(rospy.get_param_names(), rospy.get_name(), tunable):
            rospy.logwarn(f"{rospy.get_name()}: there is no parameter '{name}'; it is ignored")

    def _on_config(self, config, _level):
        self.repair(config)
        names = [entry.name for entry in dataclasses.fields(self._params_class)]
        params = self._params_class(**{name: config[name] for name in names})
        try:
            params.validate()
            self._take_params(params)
        except ValueError as error:
            rospy.logwarn(f"{rospy.get_name()}: kept the parameters as they were: {error}")
            config.update(dataclasses.asdict(self.params))
        return config

    def _take_params(self, params):
        with self._lock:
            needs_others = self.inputs_of(params) != self.inputs_of(self.params)
            self.params = params  # a scan in work keeps the set it began with
            if self._is_listening and needs_others:
                self.stop_listening()
                self.start_listening()

    def _report(self):
        updater = diagnostic_updater.Updater()
        updater.setHardwareID("none")
        updater.add("scans", self.health.report)
        while not rospy.is_shutdown():  # on the wall clock: ROS time may stand still
            updater.force_update()
            fault = self.health.standstill()
            if fault:
                self.warn(fault)
            time.sleep(1.0)


def publish_if_heard(publisher, make, timing=None):
    """Make a message only where somebody takes it, and publish it; `timing` takes note of it."""
    message = make() if publisher.get_num_connections() > 0 else None
    if timing is not None:
        timing.hands_over(message)
    if message is not None:
        publisher.publish(message)


def run(name, node_class) -> None:
    """Run a node until ROS ends it. A parameter that it cannot start with ends it at once, with a
    line that names it and a non-zero exit."""
    rospy.init_node(name)
    try:
        node_class()
    except ValueError as error:
        rospy.logfatal(f"{rospy.get_name()}: cannot start: {error}")
        raise SystemExit(1) from None
    rospy.spin()


def _queue_size() -> int:
    """~queue_size. ValueError below 1: 0 would mean without end."""
    size = rospy.get_param("~queue_size", 1)
    if size < 1:
        raise ValueError(f"{rospy.resolve_name('~queue_size')} must be at least 1, is {size}")
    return size
