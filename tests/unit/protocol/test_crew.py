from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry import Pose2
from protocol.crew import Crew
from protocol.peer_messages import Beacon

NAMES = ("ada", "bob", "cy")


def beacon(x: float = 0.0, path: int = 0, **fields: object) -> Beacon:
    points = np.full((path, 2), x, dtype=np.float32)
    values = {"life": 0, "T_map_base": Pose2(x, 0.0, 0.0), "sigma_m": 0.1, "radius_m": 0.25}
    return Beacon.model_validate({**values, "path_map": points, **fields})


def test_of_nobody_there_are_no_poses() -> None:
    told = Crew().team_poses()
    assert told.robots == ()
    assert told.poses_map.shape == (0, 4)
    assert told.paths_map.shape == (0, 2)


def test_poses_paths_and_work_of_all_are_told_by_name() -> None:
    crew = Crew()
    crew.hear("cy", beacon(3.0, path=2, busy=True), 2.0, 2.0)
    crew.hear("ada", beacon(1.0, path=1, radius_m=0.3), 1.5, 2.0)
    told = crew.team_poses()
    assert told.robots == ("ada", "cy")
    assert told.poses_map.tolist() == [[1.5, 1.0, 0.0, 0.0], [2.0, 3.0, 0.0, 0.0]]
    assert told.radii_m.tolist() == pytest.approx([0.3, 0.25])
    assert told.path_lengths == (1, 2)
    assert told.paths_map.tolist() == [[1.0, 1.0], [3.0, 3.0], [3.0, 3.0]]
    assert told.busy == (False, True)


@given(st.lists(st.tuples(st.sampled_from(NAMES), st.integers(0, 9)), max_size=20))
def test_the_newest_word_of_each_counts_in_whatever_order_it_comes(
    said: list[tuple[str, int]],
) -> None:
    crew, newest = Crew(), dict[str, int]()
    for name, stamp in said:
        news = crew.hear(name, beacon(float(stamp)), float(stamp), 9.0)
        assert news == (stamp > newest.get(name, -1))
        newest[name] = max(newest.get(name, -1), stamp)
    assert crew.stamps == newest
    assert {name: heard.T_map_base.x for name, heard in crew.beacons.items()} == newest
    assert crew.heard_within(3.0, 9.0) == sorted(n for n, t in newest.items() if 9 - t <= 3)


@given(st.floats(0.01, 1e9))
def test_a_clock_that_is_ahead_does_not_drown_what_is_said_later(ahead: float) -> None:
    crew = Crew()
    assert crew.hear("ada", beacon(1.0), 5.0 + ahead, 5.0)
    assert crew.heard_within(3.0, 8.0) == ["ada"] and crew.heard_within(3.0, 8.1) == []
    assert not crew.hear("ada", beacon(0.0), 4.0, 5.5), "sent before, come after"
    assert crew.hear("ada", beacon(2.0), 6.0, 6.1)
    assert crew.beacons["ada"].T_map_base.x == 2.0


def test_who_tells_an_error_seeks_its_place() -> None:
    crew = Crew()
    assert not crew.seeking
    crew.hear("ada", beacon(sigma_m=0.0), 1.0, 1.0)
    assert not crew.seeking
    crew.hear("bob", beacon(sigma_m=0.2), 1.0, 1.0)
    assert crew.seeking


def test_bodies_are_of_those_that_were_just_heard_and_know_their_place() -> None:
    crew = Crew()
    crew.hear("cy", beacon(3.0), 2.0, 2.0)
    crew.hear("bob", beacon(2.0, sigma_m=0.5), 2.0, 2.0)
    crew.hear("ada", beacon(1.0, radius_m=0.3), 1.0, 1.0)
    assert crew.bodies(1.0) == [("ada", 1.0, 0.0, 0.3), ("cy", 3.0, 0.0, 0.25)]
    assert [name for name, *_ in crew.bodies(1.5)] == ["cy"]


def test_where_one_was_is_remembered_until_it_knows_its_place_again() -> None:
    crew = Crew()
    crew.hear("ada", beacon(1.0), 4.0, 4.0)
    assert crew.last_heard("ada") is None and crew.last_heard("bob") is None
    crew.hear("ada", beacon(9.0, life=1, sigma_m=0.7), 5.0, 5.0)
    crew.hear("ada", beacon(9.5, life=1, sigma_m=0.7), 6.0, 6.0)
    left = crew.last_heard("ada")
    assert left is not None and (left.life, left.stamp_s, left.T_map_base.x) == (0, 4.0, 1.0)
    crew.hear("ada", beacon(1.5, life=1, sigma_m=0.0), 7.0, 7.0)
    assert crew.last_heard("ada") is None
    crew.hear("ada", beacon(9.0, life=2, sigma_m=0.7), 8.0, 8.0)
    left = crew.last_heard("ada")
    assert left is not None and (left.life, left.T_map_base.x) == (1, 1.5)
    crew.forget("ada")
    assert crew.left == {}
