from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from expedition.recordings.read import read_recording
from expedition.recordings.recording import RecordingError
from expedition.recordings.rosbag import read_rosbag
from mapping.geometry import IDENTITY, Pose2

TYPES = get_typestore(Stores.LATEST)
STORAGES = [StoragePlugin.SQLITE3, StoragePlugin.MCAP]


def make(name: str, *values: Any) -> Any:
    return TYPES.types[name](*values)


def header(stamp: float, frame: str) -> Any:
    whole = math.floor(stamp)
    time = make("builtin_interfaces/msg/Time", whole, round((stamp - whole) * 1e9))
    return make("std_msgs/msg/Header", time, frame)


def turn(roll: float, yaw: float) -> Any:
    cr, sr, cy, sy = (f(a / 2) for a in (roll, yaw) for f in (math.cos, math.sin))
    return make("geometry_msgs/msg/Quaternion", sr * cy, sr * sy, cr * sy, cr * cy)


def scan(stamp: float, ranges: list[float], **changed: float) -> Any:
    given = {"start": -0.5, "step": 0.5, "low": 0.1, "high": 30.0, **changed}
    return make(
        "sensor_msgs/msg/LaserScan",
        header(stamp, "laser"),
        given["start"],
        1.0,
        given["step"],
        0.0,
        0.1,
        given["low"],
        given["high"],
        np.array(ranges, dtype=np.float32),
        np.array([], dtype=np.float32),
    )


def odometry(stamp: float, x: float, theta: float) -> Any:
    vector = make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
    pose = make(
        "geometry_msgs/msg/Pose", make("geometry_msgs/msg/Point", x, 0.0, 0.0), turn(0.0, theta)
    )
    return make(
        "nav_msgs/msg/Odometry",
        header(stamp, "odom"),
        "base_footprint",
        make("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36)),
        make(
            "geometry_msgs/msg/TwistWithCovariance",
            make("geometry_msgs/msg/Twist", vector, vector),
            np.zeros(36),
        ),
    )


def fixed(parent: str, child: str, x: float, roll: float, yaw: float) -> Any:
    transform = make(
        "geometry_msgs/msg/Transform",
        make("geometry_msgs/msg/Vector3", x, 0.0, 0.3),
        turn(roll, yaw),
    )
    stamped = make("geometry_msgs/msg/TransformStamped", header(0.0, parent), child, transform)
    return make("tf2_msgs/msg/TFMessage", [stamped])


Messages = dict[str, list[Any]]
ODOMETRY = [odometry(10.0 + 0.1 * k, 1.0 * k, 0.1 * k) for k in range(5)]


def write(path: Path, storage: StoragePlugin, topics: Messages, spoil: bool = False) -> Path:
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for topic, messages in topics.items():
            connection = writer.add_connection(topic, messages[0].__msgtype__, typestore=TYPES)
            for number, message in enumerate(messages):
                raw = bytes(TYPES.serialize_cdr(message, message.__msgtype__))
                writer.write(connection, (20 + number) * 10**9, raw[:9] if spoil else raw)
    return path


def recorded(tmp_path: Path, **topics: list[Any]) -> Path:
    named = {"/" + name: messages for name, messages in topics.items()}
    return write(tmp_path / "bag", StoragePlugin.MCAP, named)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("part", [lambda bag: bag, lambda bag: next(bag.glob("bag.*"))])
def test_a_bag(tmp_path: Path, storage: StoragePlugin, part: Callable[[Path], Path]) -> None:
    scans = [scan(10.15, [1.0, math.inf, 3.0]), scan(10.6, [2.0, math.nan, 0.05])]
    bag = write(tmp_path / "bag", storage, {"/scan": scans, "/odom": ODOMETRY})
    recording = read_recording(part(bag))
    assert recording.skipped == []
    first, second = recording.readings
    assert first.scan.stamp == pytest.approx(10.15)
    assert first.scan.ranges.tolist() == [1.0, 30.0, 3.0]
    assert first.scan.hits.tolist() == [True, False, True]
    assert (first.scan.bearing_start, first.scan.bearing_step) == (-0.5, 0.5)
    assert first.scan.T_base_laser is IDENTITY
    np.testing.assert_allclose(first.T_wheel_base.as_tuple(), (1.5, 0.0, 0.15), atol=1e-6)
    assert second.scan.ranges.tolist() == [2.0, 0.0, 0.0]
    np.testing.assert_allclose(second.T_wheel_base.as_tuple(), (4.0, 0.0, 0.4), atol=1e-6)


def test_scans_that_cannot_be_used_are_told(tmp_path: Path) -> None:
    scans = [
        scan(9.0, [1.0, 2.0]),
        scan(10.2, [1.0]),
        scan(10.2, [1.0, 2.0], step=math.nan),
        scan(10.2, [1.0, 2.0], high=0.0),
        scan(10.2, [1.0, 2.0]),
        scan(11.0, [1.0, 2.0]),
    ]
    recording = read_rosbag(recorded(tmp_path, scan=scans, odom=ODOMETRY))
    assert len(recording.readings) == 1
    assert [part.line for part in recording.skipped] == [1, 2, 3, 4, 6]


def test_damaged_messages_and_odometry_that_is_none(tmp_path: Path) -> None:
    topics = {"/scan": [scan(10.2, [1.0, 2.0])] * 2, "/odom": [odometry(10.0, math.nan, 0.0)]}
    with pytest.raises(RecordingError, match=r"none of its 2.*no odometry"):
        read_recording(write(tmp_path / "nan", StoragePlugin.MCAP, topics))
    with pytest.raises(RecordingError, match=r"none of its 2.*decoded"):
        read_recording(write(tmp_path / "cut", StoragePlugin.MCAP, topics, spoil=True))


def test_the_laser_is_where_static_transforms_put_it(tmp_path: Path) -> None:
    frames = [
        fixed("base_link", "laser", 0.2, math.pi, math.pi / 2),
        fixed("base_footprint", "base_link", 0.1, 0.0, 0.0),
    ]
    scans = [scan(10.2, [1.0, 2.0, 3.0])]
    bag = recorded(tmp_path, scan=scans, odom=ODOMETRY, tf_static=frames)
    found = read_rosbag(bag).readings[0].scan
    np.testing.assert_allclose(found.T_base_laser.as_tuple(), (0.3, 0.0, math.pi / 2), atol=1e-9)
    assert found.ranges.tolist() == [3.0, 2.0, 1.0]  # it hangs upside down
    np.testing.assert_allclose(found.bearings, [-0.5, 0.0, 0.5])


def test_a_base_that_odometry_does_not_name(tmp_path: Path) -> None:
    frames = [fixed("base_link", "laser", 0.2, 0.0, 0.0), fixed("a", "b", 1.0, 0.0, 0.0)]
    bag = recorded(tmp_path, scan=[scan(10.2, [1.0, 2.0])], odom=ODOMETRY, tf_static=frames)
    assert read_rosbag(bag).readings[0].scan.T_base_laser == Pose2(0.2, 0.0, 0.0)


def test_topics_by_name(tmp_path: Path) -> None:
    bag = recorded(
        tmp_path, front=[scan(10.2, [1.0, 2.0])], rear=[scan(10.2, [5.0, 6.0])], odom=ODOMETRY
    )
    assert read_rosbag(bag, "/rear", "/odom").readings[0].scan.ranges.tolist() == [5.0, 6.0]
    with pytest.raises(RecordingError, match="use one of /front, /rear"):
        read_rosbag(bag, "/middle")


def test_a_bag_without_odometry(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="Odometry"):
        read_rosbag(recorded(tmp_path, scan=[scan(10.2, [1.0, 2.0])]))


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(RecordingError, match="pip install rosbags"):
        read_rosbag(tmp_path)
