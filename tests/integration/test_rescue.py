"""Robots without a master hold the same map, whatever their links and their software suffer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from expedition.launch import Watch, run_team
from mapping.geometry import Floats
from protocol.log.pose_coding import pose_steps
from protocol.messages import Message
from tests.integration.hostile_robot import LIES, Hostile
from tests.integration.rescue_team import ALONE, APART, KNOWN, Watched, in_order, rescue

pytestmark = pytest.mark.slow

PARTED = (
    "world.radio.partitions=[{start_s = 15.0, duration_s = 600.0, groups = [['robot1', 'robot3']]}]"
)
HEALED = 615.0


def check_complete(watched: Watched) -> None:
    """All hold the same, and nobody lacks anything."""
    numbers = list(watched.numbers().values())
    assert all(held == numbers[0] for held in numbers)
    assert all(in_order(held) for held in numbers[0].values())
    digests = set(watched.digests().values())
    assert len(digests) == 1 and digests != {""}


def test_four_robots_explore_without_a_server_and_hold_the_same_map() -> None:
    watched = Watched(rescue(ALONE, KNOWN))
    assert watched.run() == "explored"
    check_complete(watched)
    assert len(watched.numbers()["robot1"]) == 4


def test_a_server_that_listens_holds_the_same_map(tmp_path: Path) -> None:
    summary = run_team(rescue(KNOWN), tmp_path, Watch(), in_process=True)
    assert summary["ended"] == "explored"
    held = {robot["map_digest"] for robot in summary["robots"]}
    assert held == {summary["map"]["digest"]} != {None}
    assert summary["coverage"] > 0.98


def test_what_a_server_out_of_reach_did_not_hear_is_in_the_results_all_the_same(
    tmp_path: Path,
) -> None:
    deaf = (
        "world.radio.model=disc",
        "world.radio.range_m=30.0",
        "world.radio.server_place=[90.0, 90.0]",
    )
    summary = run_team(rescue(KNOWN, *deaf, max_time=40.0), tmp_path, Watch(), in_process=True)
    assert summary["ended"] == "time_limit"
    assert summary["coverage"] > 0.3
    assert {robot["ended"] for robot in summary["robots"]} == {"finished"}


def test_loss_doubles_and_disorder_leave_no_gap() -> None:
    bad = (
        "world.radio.loss=0.3",
        "world.radio.duplication=0.1",
        "world.radio.reordering=0.2",
    )
    watched = Watched(rescue(ALONE, KNOWN, *bad))
    assert watched.run() == "explored"
    check_complete(watched)


def test_a_partition_longer_than_anybody_waits_heals() -> None:
    watched = Watched(rescue(ALONE, KNOWN, PARTED, max_time=900.0))
    before, missing, equal = 0, 0, 0.0
    counts: dict[str, int] = {}
    alone: set[str] = set()

    def look(now: float) -> None:
        nonlocal before, missing, equal
        if now < HEALED - 0.05:
            alone.update(name for name, peer in watched.peers.items() if peer.choosing.through)
            before = watched.log_bytes()["air"]
            missing = watched.missing_bytes() if now > HEALED - 0.15 else 0
            counts.update(watched.counts())
        elif not equal and len(set(watched.held().values())) == 1:
            equal = now

    assert watched.run(look) == "explored"
    assert len(alone) == 4  # each pair was through by itself, and the world waited
    assert any("goes on" in note for note in watched.notes)
    assert HEALED < equal <= HEALED + 30.0
    # What they see from then on, together, is told on top of that.
    healing, made = watched.log_bytes()["air"] - before, watched.bytes_since(counts)
    print(
        f"equal {equal - HEALED:.1f} s after healing; {healing} bytes for {missing} that were "
        f"missing and {made} made since"
    )
    assert healing <= 1.2 * (missing + made)
    assert made < missing
    check_complete(watched)


def test_the_last_one_left_finishes_alone() -> None:
    kills = ", ".join(
        f"{{at_s = {at}, robot = 'robot{k}', kind = 'kill'}}"
        for k, at in ((1, 12.0), (3, 20.0), (4, 25.0))
    )
    watched = Watched(rescue(ALONE, KNOWN, f"world.faults=[{kills}]", max_time=400.0))
    assert watched.run() == "explored"
    assert watched.world.now < 300.0  # the way on is shut by one that stands in it


def test_robots_started_anew_go_on_with_the_map_of_the_team() -> None:
    struck = (
        'world.faults=[{at_s = 30.0, robot = "robot2", kind = "restart"}, '
        '{at_s = 45.0, robot = "robot4", kind = "reboot"}]'
    )
    watched = Watched(rescue(ALONE, KNOWN, struck))
    assert watched.run() == "explored"
    check_complete(watched)
    lives = dict.fromkeys(watched.numbers()["robot1"])
    assert ("robot2", 1) in lives  # its log was lost: a new life
    assert ("robot4", 1) not in lives  # its log was kept: the life goes on


@pytest.mark.parametrize(("seed", "starts"), [(1, None), (2, None), (1, APART)])
def test_robots_that_hardly_know_where_they_start_find_each_other(
    seed: int, starts: str | None, tmp_path: Path
) -> None:
    team = rescue(ALONE, "world.perturb_starts=true", seed=seed, starts=starts)
    summary = run_team(team, tmp_path, Watch(), in_process=True)
    assert summary["ended"] == "explored"
    held = {robot["map_digest"] for robot in summary["robots"]}
    assert held == {summary["map"]["digest"]} != {None}
    assert max(robot["trajectory_rmse_m"] for robot in summary["robots"]) <= 0.15


def test_another_stands_in_for_the_first_robot_if_that_is_gone_before_it_told_anything(
    tmp_path: Path,
) -> None:
    killed = 'world.faults=[{at_s = 0.3, robot = "robot1", kind = "kill"}]'
    team = rescue(ALONE, "world.perturb_starts=true", killed)
    summary = run_team(team, tmp_path, Watch(), in_process=True)
    assert summary["ended"] == "explored"
    lost, *others = summary["robots"]
    assert lost["ended"] == "lost"
    assert {robot["map_digest"] for robot in others} == {summary["map"]["digest"]} != {None}
    assert max(robot["trajectory_rmse_m"] for robot in others) <= 0.15


@pytest.mark.parametrize("lie", LIES, ids=lambda lie: lie.__name__)
def test_a_hostile_robot_is_named_and_shut_out_and_the_others_finish(
    lie: Callable[[Message], Message],
) -> None:
    watched = Watched(rescue(ALONE, KNOWN))
    host = watched.hosts["robot4"]
    host.core = Hostile(host.core, lie, since=12.0)
    assert watched.run() == "explored"
    honest = [f"robot{number}" for number in (1, 2, 3)]
    for name in honest:
        assert list(watched.peer(name).sharing.sync.standing.isolated) == ["robot4"]
        named = [note for note in watched.notes if note.startswith(name) and "isolated" in note]
        assert len(named) == 1 and "robot4 is isolated" in named[0]
    assert len({watched.held()[name] for name in honest}) == 1
    assert len({watched.digests()[name] for name in honest}) == 1


def test_a_correction_moves_a_robots_part_of_all_maps_within_a_second() -> None:
    """As a loop closure does: poses of long ago turn out to be elsewhere by 0.2 m."""
    watched = Watched(rescue(ALONE, KNOWN, max_time=60.0))
    robot1 = watched.peer("robot1")
    corrected = 0.0
    moved: dict[str, float] = {}

    def farther_left(poses: Floats) -> Floats:
        off = np.zeros_like(poses)
        off[:5, 1] = 0.2
        return poses + off

    def look(now: float) -> None:
        nonlocal corrected
        mapping = robot1.agent.mapping
        if not corrected and now >= 40.0 and mapping is not None:
            corrected, before = now, mapping.reported_poses
            mapping.reported_poses = lambda: farther_left(before())  # type: ignore[method-assign]
        elif corrected:
            own = robot1.sharing.sync.log.own.pose(3)
            for name, peer in watched.peers.items():
                placed = peer.sharing.shared.team.placed()
                there = [p.T_map_base for p in placed if p.author[0] == "robot1" and p.number == 3]
                if pose_steps(there[0]) == own and robot1.sharing.sync.log.own.version:
                    moved.setdefault(name, now - corrected)

    watched.run(look)
    print({name: round(seconds, 1) for name, seconds in moved.items()})
    assert len(moved) == 4
    assert max(moved.values()) <= 1.0
