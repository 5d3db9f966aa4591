"""The world's core, by events alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mapping.geometry import IDENTITY, Pose2
from protocol.body import Body, Lidar, VictimDetector
from protocol.codec import Header, encode
from protocol.effects import (
    Effect,
    Note,
    Passing,
    PassOn,
    PeerLeft,
    Rejected,
    Send,
    Stop,
    Strike,
)
from protocol.messages import Hello, MapRequest, Message
from protocol.operator_messages import PauseRequest, StopRequest
from protocol.world_messages import BodyFrame, Finished, Join, Joined, MotionCommand, Through
from sim_world.judge import Judge
from sim_world.robot_body import RobotSpec
from sim_world.settings import ScriptedFault, WorldSettings
from sim_world.truth import CoverageJudge
from sim_world.victims import Victim
from sim_world.world import World
from tests.unit.rooms import heard, room, sent
from tests.unit.sim_world.test_judge import delta, whole_truth

DT = 0.1
BODY = Body(radius_m=0.2, lidar=Lidar(beams=9, noise_m=0.0))


def world_of(
    time_limit: float | None = None,
    seed: int = 1,
    body: Body = BODY,
    victims: tuple[Victim, ...] = (),
    leaderless: bool = False,
    **settings: Any,
) -> World:
    """Two robots in the room, a metre apart."""
    scene = room()
    solid, geometry = scene.free_truth()
    coverage = CoverageJudge.for_starts(solid, geometry, [(0.0, 0.0)], 0.2)
    specs = [
        RobotSpec("robot1", body, Pose2(0.0, 0.0, 0.0), Pose2(0.1, 0.0, 0.0)),
        RobotSpec("robot2", body, Pose2(1.0, 0.0, 0.0), Pose2(1.0, 0.0, 0.0)),
    ]
    judge = Judge(coverage, 0.65, 0.35)
    rng = np.random.default_rng(seed)
    return World(
        scene,
        specs,
        WorldSettings(**settings),
        judge,
        rng,
        time_limit=time_limit,
        leaderless=leaderless,
        agreeing=leaderless,
        victims=victims,
    )


def join(world: World, name: str, now: float = 0.0, channel: str = "body") -> Message:
    role = "server" if name == "server" else "robot"
    (answer,) = sent(world.handle(heard(channel, name, Join(role=role)), now), name)
    return answer


def live(
    world: World, begin: float, seconds: float, **commands: tuple[float, float]
) -> list[Effect]:
    """Tick on, with the same commands at every instant."""
    effects: list[Effect] = []
    for k in range(1, round(seconds / DT) + 1):
        now = round(begin + k * DT, 6)
        for name, (speed, rate) in commands.items():
            word = MotionCommand(speed_m_s=speed, turn_rate_rad_s=rate)
            effects += world.handle(heard("body", name, word), now)
        effects += world.tick(now)
    return effects


def passing(channel: str, source: str, to: str, message: Message) -> Passing:
    header = Header(message.type, source, to, 1, 0.0)
    return Passing(channel, header, encode(header, message))


def test_a_robot_that_joins_is_told_its_body_and_where_it_supposedly_starts() -> None:
    joined = join(world_of(start_error_m=0.5, start_error_deg=7.0), "robot1", 0.3)
    assert isinstance(joined, Joined)
    assert joined.body == BODY
    assert joined.start == Pose2(0.1, 0.0, 0.0)
    assert (joined.start_sigma_m, joined.start_sigma_deg, joined.now_s) == (0.5, 7.0, 0.3)


def test_exact_starts_are_told_as_exact() -> None:
    joined = join(world_of(perturb_starts=False), "robot1")
    assert isinstance(joined, Joined)
    assert (joined.start_sigma_m, joined.start_sigma_deg) == (0.0, 0.0)


def test_a_server_that_joins_gets_the_clock_and_no_body() -> None:
    joined = join(world_of(), "server", channel="clock")
    assert isinstance(joined, Joined)
    assert joined.body is None
    assert joined.lockstep


def test_bodies_sense_only_when_their_software_is_there() -> None:
    world = world_of()
    assert sent(world.tick(DT), "robot1") == []
    join(world, "robot1", DT)
    frames = [m for m in sent(live(world, DT, 0.4), "robot1") if isinstance(m, BodyFrame)]
    assert len(frames) == 4
    assert sent(live(world, 0.5, 0.4), "robot2") == []
    assert [len(frame.ranges) for frame in frames] == [9, 0, 9, 0]
    assert frames[0].ranges[4] == pytest.approx(0.8, abs=0.05)  # the other robot ahead


def test_a_detector_tells_with_each_sweep_where_victims_lie_and_leaves_the_laser_alone() -> None:
    lying = (Victim(id="v1", x=0.5, y=0.2), Victim(id="v2", x=-0.5, y=0.0))
    plain = BODY.model_copy(update={"lidar": Lidar(beams=9, noise_m=0.03)})
    detector = VictimDetector(range_m=2.0, miss=0.0, noise_range=0.0, noise_bearing_deg=0.0)
    looking = plain.model_copy(update={"victim_detector": detector})
    frames: list[list[BodyFrame]] = []
    for world in (world_of(body=plain), world_of(body=looking, victims=lying)):
        join(world, "robot1")
        effects = live(world, 0.0, 0.4)
        frames.append([m for m in sent(effects, "robot1") if isinstance(m, BodyFrame)])
    without, with_one = frames
    assert all(len(frame.victims_base) == 0 for frame in without)
    assert [len(frame.victims_base) for frame in with_one] == [
        1 if len(frame.ranges) else 0 for frame in with_one
    ]
    assert sum(len(frame.victims_base) for frame in with_one) == 2
    seen = next(frame for frame in with_one if len(frame.victims_base))
    assert seen.victims_base[0].tolist() == pytest.approx([0.5, 0.2])
    for one, other in zip(without, with_one, strict=True):
        assert one.ranges.tobytes() == other.ranges.tobytes()


def test_a_command_drives_the_body_and_the_wheels_count_it() -> None:
    world = world_of()
    join(world, "robot2")
    effects = live(world, 0.0, 1.0, robot2=(0.4, 0.0))
    robot = world.robots["robot2"]
    assert 0.2 < robot.path < 0.45
    assert robot.motion.T_world_base.x == pytest.approx(1.0 + robot.path, abs=0.01)
    frame = sent(effects, "robot2")[-1]
    assert isinstance(frame, BodyFrame)
    assert frame.T_wheel_base.x == pytest.approx(robot.path, abs=0.15)
    assert world.now == 1.0


def test_without_fresh_commands_a_body_halts() -> None:
    world = world_of(command_timeout_s=0.3)
    live(world, 0.0, 0.5, robot1=(0.0, 1.0))
    live(world, 0.5, 2.0)
    before = world.robots["robot1"].motion.T_world_base
    live(world, 2.5, 1.0)
    assert world.robots["robot1"].motion.T_world_base == before


def test_a_body_stops_at_a_wall_and_notices() -> None:
    world = world_of()
    join(world, "robot2")
    effects = live(world, 0.0, 8.0, robot2=(0.5, 0.0))
    frame = sent(effects, "robot2")[-1]
    assert isinstance(frame, BodyFrame)
    assert frame.bumped
    assert world.robots["robot2"].bumps > 0
    assert world.robots["robot2"].motion.T_world_base.x < 2.9 - 0.19


def test_a_comeback_starts_the_wheels_anew_but_not_the_body() -> None:
    world = world_of()
    join(world, "robot2")
    live(world, 0.0, 1.0, robot2=(0.4, 0.0))
    place = world.robots["robot2"].motion.T_world_base
    join(world, "robot2", 1.0)
    assert world.robots["robot2"].T_wheel_base == IDENTITY
    assert world.robots["robot2"].motion.T_world_base == place


def test_a_command_of_somebody_without_a_body_moves_nothing() -> None:
    world = world_of()
    word = MotionCommand(speed_m_s=1.0, turn_rate_rad_s=0.0)
    assert world.handle(heard("body", "server", word), 0.0) == []
    assert world.handle(heard("body", "robot1", Finished(ended="explored")), 0.0) == []
    assert world.finished is None


def test_time_that_does_not_pass_moves_nothing() -> None:
    world = world_of()
    live(world, 0.0, 0.5, robot1=(0.3, 0.0))
    before = world.robots["robot1"].motion
    world.tick(0.5)
    assert world.robots["robot1"].motion == before


def test_a_process_that_left_stops_its_body() -> None:
    world = world_of()
    join(world, "robot1")
    live(world, 0.0, 0.5, robot1=(0.5, 0.0))
    (note,) = world.handle(PeerLeft("body", "robot1"), 0.5)
    assert isinstance(note, Note)
    assert "robot1 is gone" in note.text
    assert not world.robots["robot1"].connected
    assert world.robots["robot1"].command == (0.0, 0.0)


def test_without_a_server_the_mission_fails_unless_it_was_over() -> None:
    world = world_of()
    assert world.handle(PeerLeft("body", "stranger"), 0.0) == []
    assert Stop("failed") in world.handle(PeerLeft("body", "server"), 0.0)
    assert world.handle(heard("clock", "server", Finished(ended="explored")), 0.0) == [
        Stop("explored")
    ]
    assert world.handle(PeerLeft("body", "server"), 0.0) == []


def test_radio_frames_are_passed_on_byte_for_byte() -> None:
    world = world_of()
    up = passing("radio", "robot1", "server", PauseRequest(robot="a"))
    assert world.handle(up, 0.0) == [PassOn("uplink", "server", up.frame)]
    across = passing("radio", "robot1", "*", PauseRequest(robot="a"))
    assert world.handle(across, 0.0) == [PassOn("radio", "robot2", across.frame)]
    down = passing("uplink", "server", "robot2", PauseRequest(robot="a"))
    assert world.handle(down, 0.0) == [PassOn("radio", "robot2", down.frame)]
    assert set(world.relay.ledger.sent) == {
        ("robot1", "server", "pause_request"),
        ("robot1", "robot2", "pause_request"),
        ("server", "robot2", "pause_request"),
    }


def test_what_everyone_is_told_the_server_hears_once_it_has_joined() -> None:
    world = world_of()
    across = passing("radio", "robot1", "*", PauseRequest(robot="a"))
    join(world, "server", channel="clock")
    assert world.handle(across, 0.0) == [
        PassOn("radio", "robot2", across.frame),
        PassOn("uplink", "server", across.frame),
    ]


def test_a_radio_that_takes_time_delivers_when_time_has_passed() -> None:
    world = world_of(radio={"latency_s": 0.15})
    frame = passing("radio", "robot1", "server", PauseRequest(robot="a"))
    assert world.handle(frame, 0.1) == []
    assert PassOn("uplink", "server", frame.frame) not in world.tick(0.1)
    assert PassOn("uplink", "server", frame.frame) in world.tick(0.2)


def test_who_is_in_reach_goes_by_where_bodies_are_and_where_the_server_stands() -> None:
    radio = {"model": "disc", "range_m": 1.5, "server_place": (2.4, 0.0)}
    world = world_of(radio=radio)
    near = passing("radio", "robot2", "server", PauseRequest(robot="a"))
    far = passing("radio", "robot1", "server", PauseRequest(robot="a"))
    world.handle(near, 0.1)
    world.handle(far, 0.1)
    passed = [e for e in world.tick(0.1) if isinstance(e, PassOn)]
    assert passed == [PassOn("uplink", "server", near.frame)]
    assert set(world.relay.ledger.lost) == {("robot1", "server", "pause_request")}


def test_nobody_speaks_over_a_link_that_is_not_its_own() -> None:
    world = world_of()
    (note,) = world.handle(passing("uplink", "robot1", "world", whole_truth(1)), 0.0)
    assert isinstance(note, Note)
    assert "dropped a frame of robot1: the uplink is not its own link" in note.text
    assert world.handle(passing("uplink", "robot1", "world", whole_truth(1)), 0.0) == []
    assert world.handle(passing("radio", "server", "robot1", PauseRequest(robot="a")), 0.0) != []
    assert world.judge.geometry is None
    assert world.relay.ledger.sent == {}


def test_a_killed_robot_hears_nothing_more_and_what_it_had_to_say_is_lost() -> None:
    faults = (ScriptedFault(at_s=0.2, robot="robot1", kind="kill"),)
    world = world_of(faults=faults, radio={"capacity_bit_s": 2400.0})
    join(world, "robot1")
    frame = passing("radio", "robot1", "server", PauseRequest(robot="a"))  # 0.15 s on the air
    for _ in range(3):
        world.handle(frame, 0.1)
    world.tick(0.1)
    assert PassOn("uplink", "server", frame.frame) in world.tick(0.2)
    down = passing("uplink", "server", "robot1", PauseRequest(robot="a"))
    world.handle(down, 0.3)
    assert not [e for k in (3, 4, 5) for e in world.tick(k * DT) if isinstance(e, PassOn)]
    lost = {key: tally.count for key, tally in world.relay.ledger.lost.items()}
    assert lost == {
        ("robot1", "server", "pause_request"): 2,
        ("server", "robot1", "pause_request"): 1,
    }


def test_a_robot_that_starts_anew_misses_one_instant() -> None:
    faults = (ScriptedFault(at_s=0.2, robot="robot1", kind="restart"),)
    world = world_of(faults=faults, radio={"model": "disc"})
    down = passing("uplink", "server", "robot1", PauseRequest(robot="a"))
    heard_at = []
    for k in (1, 2, 3):
        world.handle(down, k * DT)
        effects = world.tick(k * DT)
        heard_at += [k for e in effects if isinstance(e, PassOn)]
    assert heard_at == [1, 3]


def test_rubbish_is_noted() -> None:
    (note,) = world_of().handle(Rejected("body", "robot1", "not msgpack"), 0.0)
    assert note == Note("warning", "dropped a frame of robot1: not msgpack")


def test_the_judge_knocks_until_it_hears_and_asks_for_what_it_missed() -> None:
    world = world_of()
    hello = Send("uplink", "server", Hello(role="observer"))
    assert hello not in world.tick(0.0)
    assert hello in world.tick(0.1)
    assert world.handle(passing("uplink", "server", "world", delta(1, 0, 0, 2, 2)), 0.1) == []
    assert hello not in world.tick(0.2)
    missed = world.handle(passing("uplink", "server", "world", delta(5, 0, 0, 2, 2)), 0.2)
    assert missed == [Send("uplink", "server", MapRequest(have=1))]
    header = Header("map_delta", "server", "world", 1, 0.0)
    (note,) = world.handle(Passing("uplink", header, [b"", b""]), 0.3)
    assert isinstance(note, Note)
    assert "dropped a word to the judge of server" in note.text
    far = passing("uplink", "server", "world", delta(2, 10**6, 10**6, 2, 2))
    (note,) = world.handle(far, 0.4)
    assert isinstance(note, Note) and "not believed" in note.text


def test_a_wanted_coverage_ends_the_mission_once() -> None:
    world = world_of(stop_at_coverage=0.9)
    live(world, 0.0, 1.0)
    world.handle(passing("uplink", "server", "world", whole_truth(1)), 1.0)
    stops = [m for m in sent(live(world, 1.0, 3.0), "server") if isinstance(m, StopRequest)]
    assert stops == [StopRequest(ended="coverage")]
    assert world.judge.timeline[-1][1] == pytest.approx(1.0)


def test_a_mission_cannot_outlast_its_limit_for_long() -> None:
    world = world_of(time_limit=1.0)
    assert Stop("time_limit") not in world.tick(30.9)
    assert Stop("time_limit") in world.tick(31.1)
    assert world.next_deadline() == pytest.approx(31.1 + 0.5 * DT)


FAULTS = (
    ScriptedFault(at_s=0.5, robot="robot1", kind="kill"),
    ScriptedFault(at_s=0.2, robot="robot2", kind="freeze", duration_s=0.2),
    ScriptedFault(at_s=0.6, robot="robot2", kind="restart"),
    ScriptedFault(at_s=0.1, robot="robot1", kind="cut_link", duration_s=0.15),
)


def test_scripted_faults_strike_on_time_and_in_order() -> None:
    world = world_of(faults=FAULTS)
    join(world, "robot1")
    join(world, "robot2")
    struck = []
    for k in range(1, 9):
        now = round(k * DT, 6)
        struck += [(now, e.peer, e.kind) for e in world.tick(now) if isinstance(e, Strike)]
        frame = passing("radio", "robot1", "server", PauseRequest(robot="a"))
        assert bool(world.handle(frame, now)) == (now >= 0.3)
    assert struck == [
        (0.2, "robot2", "freeze"),
        (0.4, "robot2", "thaw"),
        (0.5, "robot1", "kill"),
        (0.6, "robot2", "restart"),
    ]
    assert not world.robots["robot1"].connected
    assert not world.robots["robot2"].connected


def test_the_same_seed_gives_the_same_world() -> None:
    def ends(seed: int) -> list[Pose2]:
        world = world_of(seed=seed)
        live(world, 0.0, 1.0, robot1=(0.3, 0.5), robot2=(0.3, 0.1))
        return [robot.T_wheel_base for robot in world.robots.values()]

    assert ends(3) == ends(3)
    assert ends(3) != ends(4)


# --- a team without a server ---------------------------------------------------------------------


def leaderless(**settings: Any) -> World:
    world = world_of(leaderless=True, **settings)
    for name in ("robot1", "robot2"):
        join(world, name)
    return world


def asked(effects: list[Effect]) -> list[tuple[str, MapRequest]]:
    return [
        (e.to, e.message)
        for e in effects
        if isinstance(e, Send) and isinstance(e.message, MapRequest)
    ]


def said(world: World, name: str, held: int, now: float) -> None:
    """A robot says that it finds nothing more to do."""
    assert world.handle(heard("body", name, Through(through=True, held=held)), now) == []


def test_without_a_server_the_judge_asks_a_robot_for_the_map() -> None:
    world = leaderless()
    effects = live(world, 0.0, 0.5)
    assert asked(effects)[0] == ("robot1", MapRequest(have=0))
    assert sent(effects, "server") == []
    assert world.handle(heard("body", "robot1", whole_truth(3)), 0.5) == []
    assert world.judge.number == 3
    live(world, 0.5, 2.0)
    assert world.judge.timeline[-1][1] == pytest.approx(1.0)


def test_when_that_one_is_gone_the_judge_asks_another() -> None:
    world = leaderless()
    live(world, 0.0, 0.5)
    world.handle(heard("body", "robot1", whole_truth(3)), 0.5)
    world.handle(PeerLeft("body", "robot1"), 0.5)
    assert asked(live(world, 0.5, 2.0))[-1] == ("robot2", MapRequest(have=0))


def test_a_word_to_the_judge_that_cannot_be_is_dropped_and_named() -> None:
    world = leaderless()
    live(world, 0.0, 0.5)
    world.handle(heard("body", "robot1", whole_truth(3)), 0.5)
    (note,) = world.handle(heard("body", "robot1", delta(4, 10**6, 10**6, 2, 2)), 0.5)
    assert isinstance(note, Note) and "a word to the judge of robot1" in note.text


def test_it_is_over_when_all_robots_that_are_there_are_through_and_hold_the_same() -> None:
    world = leaderless()
    said(world, "robot1", 5, 1.0)
    assert Stop("explored") not in live(world, 1.0, 1.0)
    said(world, "robot2", 4, 2.0)
    assert Stop("explored") not in live(world, 2.0, 1.0)
    said(world, "robot2", 5, 3.0)
    assert Stop("explored") in live(world, 3.0, 2.0)
    assert world.finished is not None and world.finished.ended == "explored"


def test_it_is_over_when_the_last_one_that_was_waited_for_is_gone() -> None:
    world = leaderless()
    said(world, "robot1", 5, 1.0)
    assert Stop("explored") not in live(world, 1.0, 2.0)
    world.handle(PeerLeft("body", "robot2"), 3.0)
    assert Stop("explored") in live(world, 3.0, 2.0)


def test_one_that_was_started_anew_is_not_through() -> None:
    world = leaderless(faults=(ScriptedFault(at_s=2.0, robot="robot2", kind="restart"),))
    said(world, "robot2", 5, 1.0)
    live(world, 1.0, 1.5)
    join(world, "robot2", 2.5)
    said(world, "robot1", 5, 2.6)
    assert Stop("explored") not in live(world, 2.6, 2.0)
    said(world, "robot2", 5, 5.0)
    assert Stop("explored") in live(world, 5.0, 2.0)


def test_one_that_is_gone_with_all_others_does_not_end_it() -> None:
    """They may be started anew; if not, the mission ends by time."""
    world = leaderless()
    for name in ("robot1", "robot2"):
        world.handle(PeerLeft("body", name), 1.0)
    effects = live(world, 1.0, 3.0)
    assert not [e for e in effects if isinstance(e, Stop)]
    assert asked(effects) == []


def test_without_a_server_it_ends_on_time_and_at_a_wanted_coverage() -> None:
    world = leaderless(time_limit=1.0)
    assert Stop("time_limit") not in live(world, 0.0, 0.9)
    assert Stop("time_limit") in live(world, 0.9, 0.2)
    world = leaderless(stop_at_coverage=0.9)
    live(world, 0.0, 0.5)
    world.handle(heard("body", "robot1", whole_truth(3)), 0.5)
    assert Stop("coverage") in live(world, 0.5, 2.0)
    assert world.finished is not None and world.finished.ended == "coverage"
