"""ROS 2 bags: sqlite3 and mcap, folders and single files."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from expedition.recordings.fields import FARTHEST, DamagedError
from expedition.recordings.recording import Reading, Recording, RecordingError, Skipped
from expedition.recordings.ros_frames import StaticFrames, yaw
from expedition.recordings.ros_scan import scan_from
from mapping.geometry import Pose2, interpolate
from mapping.scan import LaserScan

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"

NEAR = 0.5
"""Odometry says where a scan was taken when it is no more than this [s] away."""


def read_rosbag(
    path: Path, scan_topic: str | None = None, odometry_topic: str | None = None
) -> Recording:
    """Return the readings of a bag.

    Args:
        path: a folder with metadata.yaml, or one .mcap or .db3 file.
        scan_topic: of sensor_msgs/LaserScan messages; the first in the bag if not told.
        odometry_topic: of nav_msgs/Odometry messages; the first in the bag if not told.

    Returns:
        One reading for each scan that has odometry near; skipped messages are counted within
        their topic, from 1.

    Raises:
        RecordingError: it is no bag, is broken, or has no such topics.
    """
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise RecordingError("to read a ROS bag, first run: pip install rosbags") from None
    if path.is_file() and path.suffix not in (".mcap", ".db3"):
        raise RecordingError("this is a ROS bag: rename it to end in .mcap or .db3")
    try:
        with Reader(path) as reader:
            bag = _Bag(reader, get_typestore(Stores.LATEST))
            return _recording(bag, scan_topic, odometry_topic)
    except RecordingError:
        raise
    # A broken bag makes the library and its databases raise whatever they happen to trip over.
    except Exception as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise RecordingError(
            f"broken ROS bag ({said}): copy it again, or mend it with `ros2 bag reindex`"
        ) from None


class _Bag:
    """The messages of an open bag, topic by topic."""

    def __init__(self, reader: Reader, types: Typestore) -> None:
        self._reader = reader
        self._types = types

    def topic(self, kind: str, named: str | None) -> Connection:
        """Return the topic of a type: the one that was named, or else the first.

        Raises:
            RecordingError: there is none.
        """
        of_kind = [c for c in self._reader.connections if c.msgtype == kind]
        for connection in of_kind:
            if named is None or connection.topic == named:
                return connection
        if of_kind:
            known = ", ".join(connection.topic for connection in of_kind)
            raise RecordingError(f"no topic {named!r} of {kind}: use one of {known}")
        raise RecordingError(f"no topic of {kind} in the bag: record one and try again")

    def static_frames(self) -> StaticFrames:
        """Return the frames of /tf_static; none if nobody told of them."""
        frames = StaticFrames()
        for connection in self._reader.connections:
            if connection.msgtype == TRANSFORMS and connection.topic.endswith("tf_static"):
                for message, _ in self.messages(connection):
                    for transform in message.transforms if message is not None else ():
                        frames.add(transform)
        return frames

    def messages(self, connection: Connection) -> Iterator[tuple[Any, float]]:
        """Yield the messages of a topic with their times of arrival [s]; None for damaged ones."""
        for _, arrival, raw in self._reader.messages([connection]):
            try:
                message = self._types.deserialize_cdr(raw, connection.msgtype)
            # The decoder is made for sound bytes: damaged ones trip it in many ways.
            except Exception:
                message = None
            yield message, arrival * 1e-9


class _Odometry:
    """Where the wheels put the robot over time."""

    def __init__(self) -> None:
        self._samples: list[tuple[float, Pose2]] = []
        self.base = ""

    def add(self, message: Any, stamp: float) -> None:
        """Take a nav_msgs/Odometry, if it makes sense."""
        pose = message.pose.pose
        T_wheel_base = Pose2(pose.position.x, pose.position.y, yaw(pose.orientation))
        if all(math.isfinite(v) and abs(v) <= FARTHEST for v in T_wheel_base.as_tuple()):
            self._samples.append((stamp, T_wheel_base))
            self.base = self.base or message.child_frame_id

    def sort(self) -> None:
        """Put samples in the order of their stamps, for `at`."""
        self._samples.sort(key=_stamp)

    def at(self, stamp: float) -> Pose2 | None:
        """Return `T_wheel_base` at a time [s]: between two samples, or the last one before."""
        after = bisect_right(self._samples, stamp, key=_stamp)
        if after == 0 or stamp - self._samples[after - 1][0] > NEAR:
            return None
        earlier, T_wheel_earlier = self._samples[after - 1]
        if after == len(self._samples) or self._samples[after][0] - stamp > NEAR:
            return T_wheel_earlier
        later, T_wheel_later = self._samples[after]
        return interpolate(T_wheel_earlier, T_wheel_later, (stamp - earlier) / (later - earlier))


def _recording(bag: _Bag, scan_topic: str | None, odometry_topic: str | None) -> Recording:
    scans = bag.topic(SCAN, scan_topic)
    odometry = _odometry(bag, bag.topic(ODOMETRY, odometry_topic))
    frames = bag.static_frames()
    recording = Recording([])
    for number, (message, arrival) in enumerate(bag.messages(scans), 1):
        try:
            scan = _scan(message, arrival, frames, odometry.base)
            T_wheel_base = odometry.at(scan.stamp)
            if T_wheel_base is None:
                raise DamagedError(f"no odometry within {NEAR} s")
            recording.readings.append(Reading(scan, T_wheel_base))
        except DamagedError as damage:
            recording.skipped.append(Skipped(number, str(damage)))
    if not recording.readings and not recording.skipped:
        raise RecordingError(f"no message on {scans.topic}: record one with scans and try again")
    return recording


def _odometry(bag: _Bag, connection: Connection) -> _Odometry:
    odometry = _Odometry()
    for message, arrival in bag.messages(connection):
        if message is not None:
            odometry.add(message, _measured(message, arrival))
    odometry.sort()
    return odometry


def _scan(message: Any, arrival: float, frames: StaticFrames, base: str) -> LaserScan:
    if message is None:
        raise DamagedError("the message cannot be decoded")
    mounting = frames.mounting(message.header.frame_id, base)
    return scan_from(message, _measured(message, arrival), mounting)


def _measured(message: Any, arrival: float) -> float:
    """Return the stamp [s] of a message, that of its arrival if nobody set it."""
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9) or arrival


def _stamp(sample: tuple[float, Pose2]) -> float:
    return sample[0]
