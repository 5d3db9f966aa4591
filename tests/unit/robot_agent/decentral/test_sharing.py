from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from mapping.estimator import OthersScan
from mapping.geometry import IDENTITY, Floats, Pose2
from protocol.body import Body, Drive
from protocol.effects import Send
from protocol.log.author_log import Author, Entry
from protocol.log.messages import LogHave, LogMessage, Observations, PoseSet
from protocol.log.pose_coding import pose_of, pose_steps
from protocol.messages import MapSnapshot, PoseUpdate, ScanReport
from protocol.reported_scan import scan_of
from protocol.world_messages import Joined
from robot_agent.decentral.own_poses import own_table
from robot_agent.decentral.sharing import Sharing
from robot_agent.local_mapping import LocalMapping
from robot_agent.settings import LocalMapSettings
from tests.unit.robot_agent.decentral.peer_rig import ROOM, seen_by, sharing_of, sync_of
from tests.unit.rooms import scan_in

T_MAP_OWN = Pose2(0.4, 0.2, 0.15)
SEEN = [Pose2(0.2 * k, 0.1 * k, 0.3 * k) for k in range(5)]


def joined(start: Pose2 = IDENTITY, sigma: float = 0.0) -> Joined:
    return Joined(
        lockstep=True, now_s=0.0, step_s=0.1, start=start, start_sigma_m=sigma, start_sigma_deg=8.0
    )


class Corrected(LocalMapping):
    """One that may find that all it reported was farther along its own x axis."""

    shift = 0.0
    others: Sequence[OthersScan] = ()
    told = 0

    def take_others(self, scans: Sequence[OthersScan]) -> None:
        self.others = scans
        self.told += 1

    def reported_poses(self) -> Floats:
        poses: Floats = super().reported_poses() + np.array([self.shift, 0.0, 0.0])
        return poses


class Robot:
    """A robot's own mapping and its share of the team's, in the room.

    Its own map begins where it stands at first: at `T_MAP_OWN`.
    """

    def __init__(
        self, reference: bool = True, sigma: float = 0.0, first: bool = True, **settings: object
    ) -> None:
        body = Body(drive=Drive(noise_distance=0.0))
        own = LocalMapSettings(resolution_m=0.1)
        self.mapping = Corrected(body, own, "scan_matching", np.random.default_rng(0))
        self.sharing: Sharing = sharing_of(sync_of(life=0 if first else 1), reference, **settings)
        self.told = joined(T_MAP_OWN if sigma == 0.0 else IDENTITY, sigma)
        self.first = first
        self.now = 0.0
        self._T_map_base = T_MAP_OWN

    def begin(self) -> None:
        self.sharing.begin(self.told, self.mapping, self.first)

    def look(self, step: Pose2 = IDENTITY) -> ScanReport:
        """Drive on, look, and share what was seen."""
        self.now = round(self.now + 1.0, 6)
        self._T_map_base = self._T_map_base @ step
        T_wheel_base = T_MAP_OWN.inverse() @ self._T_map_base
        self.mapping.take(scan_in(ROOM, self._T_map_base, self.now), T_wheel_base)
        report = self.mapping.report()
        self.sharing.observe(report, self.now)
        return report


def poses_of(robot: Robot) -> list[Pose2]:
    return [pose_of(row) for row in own_table(robot.sharing.sync).tolist()]


# --- one that knows where it starts --------------------------------------------------------------


@pytest.mark.parametrize(
    ("reference", "sigma", "tied"),
    [(True, 1.0, True), (False, 0.1, True), (False, 0.2, False)],
)
def test_who_knows_where_it_is_from_the_start(reference: bool, sigma: float, tied: bool) -> None:
    robot = Robot(reference, sigma)
    assert robot.sharing.place_due((), 0.0) is None  # it has no body yet
    robot.begin()
    assert robot.sharing.tied == tied
    assert robot.sharing.home == ((0.0, 0.0) if tied else None)


def test_one_that_was_told_no_start_is_at_the_origin() -> None:
    robot = Robot()
    robot.sharing.begin(Joined(lockstep=True, now_s=0.0, step_s=0.1), robot.mapping, True)
    assert robot.sharing.home == (0.0, 0.0)


def test_observations_are_placed_in_the_teams_map_and_told() -> None:
    robot = Robot()
    robot.begin()
    robot.look()
    robot.look(Pose2(0.2, 0.0, 0.0))
    assert robot.sharing.home == (0.4, 0.2)
    first, second = poses_of(robot)
    assert first.distance_to(T_MAP_OWN) < 0.002
    assert second.distance_to(T_MAP_OWN @ Pose2(0.2, 0.0, 0.0)) < 0.05
    assert robot.sharing.tick(1.0) == []
    told = [e for e in robot.sharing.tick(9.0) if isinstance(e, Send)]
    assert (told[0].channel, told[0].to) == ("radio", "*")
    assert isinstance(told[0].message, Observations) and told[0].message.numbers == (1, 2)
    robot.sharing.follow(9.0)
    assert len(robot.sharing.shared.team) == 2


def test_its_software_is_told_where_its_map_lies_when_that_is_news() -> None:
    robot = Robot(repose_period_s=0.5)
    robot.begin()
    told = robot.sharing.place_due((), 0.0)
    assert told is not None and told.matched and told.T_map_odom == T_MAP_OWN
    assert robot.sharing.place_due((), 0.4) is None
    assert robot.sharing.place_due((), 0.6) is None
    assert robot.sharing.next_deadline() <= 1.1


def test_poses_that_turn_out_otherwise_are_told_anew() -> None:
    robot = Robot()
    robot.begin()
    for _ in range(3):
        robot.look(Pose2(0.1, 0.0, 0.0))
    robot.sharing.tick(3.0)
    robot.sharing.place_due((), 3.0)
    assert robot.sharing.repositionings == []
    robot.mapping.shift = 0.3
    update = robot.sharing.place_due((), 4.0)
    assert update is not None
    assert update.T_map_odom.distance_to(T_MAP_OWN @ Pose2(0.3, 0.0, 0.0)) < 0.01
    assert robot.sharing.repositionings == []
    robot.sharing.tick(9.0)
    (change,) = robot.sharing.repositionings
    assert (change["t_s"], change["robot"]) == (9.0, "me")
    assert robot.sharing.sync.log.own.version == 1
    np.testing.assert_allclose(change["poses"], [pose.as_tuple() for pose in poses_of(robot)])


def test_the_track_is_in_the_teams_map_once_it_knows_where_that_is() -> None:
    robot = Robot()
    assert robot.sharing.track().shape == (0, 4)
    robot.begin()
    robot.look()
    robot.look(Pose2(0.2, 0.0, 0.0))
    track = robot.sharing.track()
    assert track[:, 0].tolist() == [1.0, 2.0]
    assert track[0, 1:].tolist() == pytest.approx(T_MAP_OWN.as_tuple(), abs=1e-3)
    assert math.hypot(*(track[1, 1:3] - track[0, 1:3])) == pytest.approx(0.2, abs=0.05)


# --- one that must find out where it is ----------------------------------------------------------


def test_what_it_saw_waits_until_it_fits_what_the_others_saw() -> None:
    robot = Robot(reference=False, sigma=0.5)
    robot.begin()
    robot.look()
    robot.look(Pose2(0.1, 0.0, 0.1))
    assert robot.sharing.place_due((), 2.0) is None
    assert robot.sharing.sync.log.own.count == 0
    robot.sharing.take("bob", message_of(*SEEN), 2.5)
    placed = tied(robot)
    assert placed.matched
    assert placed.T_map_odom.distance_to(T_MAP_OWN) < 0.08
    looks = robot.sharing.sync.log.own.count
    assert looks >= 2
    robot.look()
    assert robot.sharing.sync.log.own.count == looks + 1


def test_a_poor_fit_is_none() -> None:
    for settings in ({"points": 10_000}, {"sigma_m": 1e-6}):
        robot = Robot(reference=False, sigma=0.5, tying=settings)
        robot.begin()
        robot.look()
        robot.sharing.take("bob", message_of(*SEEN[:3]), 2.5)
        assert robot.sharing.place_due((), 3.0) is None
        assert not robot.sharing.tied


def test_one_that_was_started_anew_looks_where_it_was_seen_last() -> None:
    """It was told to start somewhere else; of its life before it left one observation."""
    robot = Robot(first=False)
    robot.told = joined(Pose2(30.0, 30.0, 0.0))
    robot.sharing.take("bob", message_of(*SEEN), 0.5)
    left = seen_by("me", Pose2(0.3, 0.1, 0.0))
    assert isinstance(left, Observations)
    robot.sharing.take("bob", left.model_copy(update={"author": "me"}), 0.6)
    robot.begin()
    assert not robot.sharing.tied
    assert tied(robot).T_map_odom.distance_to(T_MAP_OWN) < 0.08


def test_a_tie_that_is_a_little_off_is_mended_and_all_poses_are_told_anew() -> None:
    robot = Robot(reference=False, sigma=0.5)
    robot.begin()
    robot.sharing.take("bob", message_of(*SEEN), 0.5)
    true = tied(robot).T_map_odom
    off = true @ Pose2(0.06, 0.0, 0.02)
    robot.sharing.place.T_map_own = off
    robot.sharing._tie(off)
    for _ in range(4):
        robot.look(Pose2(0.05, 0.0, 0.4))
    robot.sharing.tick(robot.now + 10.0)
    placed = robot.sharing.place_due((), robot.now + 20.0)
    assert placed is not None and placed.T_map_odom.distance_to(true) < 0.04
    robot.sharing.tick(robot.now + 30.0)
    assert robot.sharing.sync.log.own.version >= 1
    last = poses_of(robot)[-1]
    assert last.distance_to(robot._T_map_base) < 0.04


def test_one_that_hears_nobody_settles_where_it_may_be_and_corrects_that_later() -> None:
    robot = Robot(first=False, tying={"alone_s": 3.0, "settle_s": 5.0})
    robot.told = joined(Pose2(0.1, -0.2, 0.0))
    robot.begin()
    for _ in range(5):
        robot.look(Pose2(0.0, 0.0, 0.3))
        robot.sharing.place_due((), robot.now)
        assert not robot.sharing.tied
    robot.look()
    placed = robot.sharing.place_due((), robot.now)
    assert placed is not None and placed.matched and robot.sharing.tied
    assert placed.T_map_odom.distance_to(Pose2(0.1, -0.2, 0.0)) < 0.01
    assert len(poses_of(robot)) == 6, "what it saw before is told now"
    assert robot.sharing.place.whereabouts.sigma[0] > 0.3, "it does not say that it is sure"
    robot.sharing.hears("bob", robot.now)
    robot.sharing.take("bob", message_of(*SEEN), robot.now)
    for _ in range(12):
        robot.look(Pose2(0.0, 0.0, 0.5))
        robot.sharing.place_due((), robot.now + 10.0)
    assert robot.sharing.place.whereabouts.sigma == (0.0, 0.0)
    assert poses_of(robot)[0].distance_to(T_MAP_OWN) < 0.08, "what it told is put right"


def test_one_that_hears_somebody_waits_until_it_knows_where_it_is() -> None:
    robot = Robot(first=False, tying={"alone_s": 3.0, "settle_s": 5.0})
    robot.begin()
    for _ in range(12):
        robot.look(Pose2(0.0, 0.0, 0.3))
        robot.sharing.hears("bob", robot.now)
        robot.sharing.place_due((), robot.now)
        assert not robot.sharing.tied


def tied(robot: Robot) -> PoseUpdate:
    """Let a robot turn until it knows where it is; a place is believed that comes again."""
    for _ in range(12):
        robot.look(Pose2(0.0, 0.0, 0.5))
        placed = robot.sharing.place_due((), robot.now + 1.0)
        if placed is not None:
            return placed
    raise AssertionError("it never found its place")


def message_of(*poses: Pose2) -> LogMessage:
    return seen_message(*poses)


def seen_message(*poses: Pose2, name: str = "bob", first: int = 1) -> Observations:
    message = seen_by(name, *poses, first=first)
    assert isinstance(message, Observations)
    return message


# --- what the others saw, for its own filter -----------------------------------------------------


def told_of_others(robot: Robot) -> Sequence[OthersScan]:
    """What its estimator knows of the others after the map was drawn once more."""
    robot.now += 1.0
    robot.sharing.delta_due(robot.now)
    return robot.mapping.others


def test_its_estimator_hears_what_others_saw_and_not_what_it_saw_itself() -> None:
    robot = Robot(use_team_map=True)
    robot.sharing.take("bob", message_of(*SEEN[:2]), 0.5)
    assert told_of_others(robot) == ()  # it has no body, and no map of its own yet
    robot.begin()
    robot.look()
    first, second = told_of_others(robot)
    assert (first.author, first.number, second.number) == (("bob", 0), 1, 2)
    placed = T_MAP_OWN @ second.T_odom_base
    assert placed.distance_to(SEEN[1]) < 0.002, "in the frame of the robot's own map"
    before = robot.mapping.told
    told_of_others(robot)
    assert robot.mapping.told == before, "that is no news"
    robot.sharing.take("bob", seen_message(SEEN[2], first=3), robot.now)
    assert [seen.number for seen in told_of_others(robot)] == [1, 2, 3]


def test_unless_it_is_asked_to_an_estimator_hears_nothing_of_others() -> None:
    robot = Robot()
    robot.begin()
    robot.sharing.take("bob", message_of(*SEEN), 0.5)
    assert told_of_others(robot) == ()


def test_what_an_isolated_peer_saw_counts_no_more() -> None:
    robot = Robot(use_team_map=True)
    robot.begin()
    robot.sharing.take("bob", message_of(*SEEN), 0.5)
    robot.sharing.take("ann", seen_message(SEEN[0], name="ann"), 0.5)
    assert len(told_of_others(robot)) == len(SEEN) + 1
    for k in range(5):
        robot.sharing.fault("ann", f"nonsense: {k}", robot.now)
    assert {seen.author[0] for seen in told_of_others(robot)} == {"bob"}


def test_what_it_saw_before_it_was_started_anew_is_as_if_another_had_seen_it() -> None:
    robot = Robot(use_team_map=True, first=False)
    robot.sharing.take("bob", seen_message(SEEN[0]).model_copy(update={"author": "me"}), 0.5)
    robot.sharing.take("bob", message_of(*SEEN), 0.6)
    robot.begin()
    tied(robot)
    authors = {seen.author for seen in told_of_others(robot)}
    assert authors == {("me", 0), ("bob", 0)}


# --- the team's ----------------------------------------------------------------------------------


def test_peers_are_heard_until_they_are_isolated() -> None:
    robot = Robot()
    assert robot.sharing.hears("bob", 0.0)
    told = []
    for k in range(5):
        told += robot.sharing.fault("bob", f"nonsense: {k}", 1.0)
    assert not robot.sharing.hears("bob", 2.0)
    assert told


def test_who_tells_what_is_no_observation_is_to_blame() -> None:
    robot = Robot()
    sync = robot.sharing.sync
    sync.log.put(Author("bob", 0), 1, Entry(b"", (0, 0, 0), 0), "ann")
    robot.sharing.follow(1.0)
    assert not sync.standing.book.counts, "who passes it on could not help it"
    sync.log.put(Author("bob", 0), 2, Entry(b"", (0, 0, 0), 0), "bob")
    robot.sharing.follow(2.0)
    ((peer, _),) = sync.standing.book.counts
    assert peer == "bob"


def test_nobody_is_to_blame_for_a_scan_beyond_the_largest_map() -> None:
    robot = Robot()
    robot.begin()
    robot.look()
    (first,) = (entry.what for entry in robot.sharing.sync.log.own.entries.values())
    far = Entry(first.payload, pose_steps(Pose2(2000.0, 0.0, 0.0)), 0)
    robot.sharing.sync.log.put(Author("bob", 0), 1, far, "bob")
    robot.sharing.follow(1.0)
    assert robot.sharing.sync.standing.book.counts == {}


def test_the_map_is_told_to_its_software_as_it_grows() -> None:
    robot = Robot(map_period_s=0.5)
    robot.begin()
    robot.look()
    delta = robot.sharing.delta_due(1.0)
    assert delta is not None and delta.number == 1
    robot.look(Pose2(0.2, 0.0, 0.0))
    assert robot.sharing.delta_due(1.2) is None
    assert robot.sharing.delta_due(1.5) is not None


def test_a_judge_is_told_nothing_while_there_is_nothing() -> None:
    robot = Robot()
    assert robot.sharing.told_judge(0) is None
    robot.begin()
    robot.look()
    robot.sharing.follow(1.0)
    assert isinstance(robot.sharing.told_judge(0), MapSnapshot)
    assert robot.sharing.told_judge(1) is None


def test_two_that_hold_the_same_have_the_same_checksum_and_the_same_map() -> None:
    robot, other = Robot(), sharing_of(sync_of("bob"))
    robot.begin()
    for _ in range(3):
        robot.look(Pose2(0.1, 0.0, 0.1))
    sent = [e.message for e in robot.sharing.tick(9.0) if isinstance(e, Send)]
    assert other.checksum() != robot.sharing.checksum()
    for message in sent:
        assert isinstance(message, Observations | PoseSet | LogHave)
        other.take("me", message, 9.0)
    assert other.checksum() == robot.sharing.checksum() != 0
    for sharing in (other, robot.sharing):
        sharing.follow(9.0)
    np.testing.assert_array_equal(
        other.shared.team.grid().log_odds, robot.sharing.shared.team.grid().log_odds
    )


def test_the_scan_of_a_report_is_the_scan_that_was_taken() -> None:
    robot = Robot()
    robot.begin()
    scan, taken = scan_of(robot.look()), robot.mapping.scan
    assert taken is not None
    np.testing.assert_array_equal(scan.ranges, taken.ranges)
    assert (scan.stamp, scan.range_max) == (taken.stamp, taken.range_max)
