from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from mapping.scan import LaserScan
from protocol.body import Body
from protocol.messages import TeamPoses
from robot_agent.team_view import Teammates
from sim_world.raycast import cast_discs


def poses(*names: str, lengths: tuple[int, ...] | None = None, busy: bool = False) -> TeamPoses:
    """Robot k stands at (k, 0) since second k and is about to drive to (k, 1)."""
    count = len(names)
    table = [[float(k), float(k), 0.0, 0.0] for k in range(count)]
    path = [[float(k), 1.0] for k in range(count)]
    return TeamPoses(
        robots=names,
        poses_map=np.array(table).reshape(-1, 4),
        radii_m=np.full(count, 0.25, dtype=np.float32),
        uncertainty_m=np.zeros(count, dtype=np.float32),
        paths_map=np.array(path, dtype=np.float32).reshape(-1, 2),
        path_lengths=lengths or (1,) * count,
        busy=(busy,) * count,
    )


def test_the_others_are_known_with_their_ways_and_oneself_is_not_among_them() -> None:
    view = Teammates("b")
    view.hear(poses("a", "b", "c"))
    assert [mate.name for mate in view.others] == ["a", "c"]
    assert view.others[1].T_map_base == Pose2(2.0, 0.0, 0.0)
    assert view.others[1].path_map.tolist() == [[2.0, 1.0]]
    assert view.others[1].stamp == 2.0


def test_a_message_that_contradicts_itself_changes_nothing() -> None:
    view = Teammates("b")
    view.hear(poses("a", "b"))
    before = view.others
    good = poses("a", "b", "c")
    for wrong in (
        good.model_copy(update={"robots": ("a",)}),
        good.model_copy(update={"path_lengths": (1, 1, 5)}),
        good.model_copy(update={"busy": (True,)}),
    ):
        view.hear(wrong)
        assert view.others == before


def scan(stamp: float, *ranges: float) -> LaserScan:
    return LaserScan(np.array(ranges, dtype=np.float32), 0.0, 0.5 * math.pi, 5.0, stamp)


def test_beams_that_end_at_a_teammate_are_ignored() -> None:
    view = Teammates("b")
    seen = scan(0.0, 1.9, 2.0, 5.0)
    assert view.mask(seen, IDENTITY, 0.2) is seen
    view.hear(poses("x", "b", "c"))
    assert view.mask(seen, IDENTITY, 0.2).ranges.tolist() == [0.0, 2.0, 5.0]


def test_one_that_drives_may_have_gone_on_since_it_was_heard_of() -> None:
    view = Teammates("b")
    far = scan(9.0, 1.6, 3.0)
    view.hear(poses("b", "x"))
    assert view.mask(far, IDENTITY, 0.2).ranges[0] > 0.0
    view.hear(poses("b", "x", busy=True))
    assert view.mask(far, IDENTITY, 0.2).ranges[0] == 0.0


def test_the_distance_to_the_nearest_other() -> None:
    view = Teammates("b")
    assert view.nearest(IDENTITY) == math.inf
    view.hear(poses("b", "x", "c"))
    assert view.nearest(Pose2(0.4, 0.0, 0.0)) == pytest.approx(0.6)


def test_teammates_are_found_by_their_size() -> None:
    bearings = -math.pi / 2 + math.radians(1.0) * np.arange(181)
    seen = cast_discs(np.array([[1.0, 0.0, 0.25]]), IDENTITY, bearings, 8.0)
    sweep = LaserScan(seen.astype(np.float32), -math.pi / 2, math.radians(1.0), 8.0, 0.0)
    view = Teammates("b")
    assert len(view.find_in(sweep, Body(radius_m=0.25))) == 1
    assert len(view.find_in(sweep, Body(radius_m=0.6))) == 0
    view.hear(poses("a", "b"))  # told radii count more than one's own
    assert len(view.find_in(sweep, Body(radius_m=0.6))) == 1
