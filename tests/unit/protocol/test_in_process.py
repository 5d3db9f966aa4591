from __future__ import annotations

from protocol.effects import Effect, Event, Note, PeerLeft, Received, Send, Stop, Strike
from protocol.host import Host
from protocol.in_process import run_in_process
from protocol.world_messages import Ping
from tests.unit.protocol.cores import Scripted, host_of

STEP = 0.1
Notes = list[tuple[str, Note]]


def world_until(end: float, strikes: dict[float, Strike] | None = None) -> Scripted:
    """A world that speaks to `robot1` at every instant, strikes, and ends."""

    def beat(now: float) -> list[Effect]:
        effects: list[Effect] = [Send("body", "robot1", Ping(value=now))]
        effects += [s for at, s in (strikes or {}).items() if abs(at - now) < 1e-9]
        return [*effects, Stop("explored")] if now >= end - 1e-9 else effects

    return Scripted(deadline=0.0, beat=beat)


def echo(event: Event, now: float) -> list[Effect]:
    return [Note("info", "heard"), Send("body", "world", Ping(value=now))]


def play(world: Scripted, members: dict[str, Host], notes: Notes | None = None) -> str:
    def on_note(name: str, note: Note) -> None:
        if notes is not None:
            notes.append((name, note))

    return run_in_process(host_of("world", world), members, STEP, on_note)


def test_a_run_goes_on_until_the_world_stops() -> None:
    world, robot, notes = world_until(0.3), Scripted(react=echo), Notes()
    assert play(world, {"robot1": host_of("robot1", robot)}, notes) == "explored"
    assert world.ticks == [STEP, 2 * STEP, 3 * STEP]
    assert [now for now, _ in robot.events] == [STEP, 2 * STEP, 3 * STEP]
    assert notes == [("robot1", Note("info", "heard"))] * 3
    answers = [event.message for _, event in world.events if isinstance(event, Received)]
    assert answers == [Ping(value=STEP), Ping(value=2 * STEP)]


def test_what_the_world_logs_is_told_under_its_name() -> None:
    world, notes = Scripted(deadline=0.0, beat=lambda now: [Note("info", "x"), Stop("y")]), Notes()
    play(world, {}, notes)
    assert notes == [("world", Note("info", "x"))]


def test_a_run_can_be_broken_off() -> None:
    asked = iter([True, True, False])
    world = world_until(9.0)
    end = run_in_process(
        host_of("world", world), {}, STEP, lambda name, note: None, lambda: next(asked)
    )
    assert end == "broken off"
    assert len(world.ticks) == 2


def test_a_killed_robot_does_not_live_on() -> None:
    robot = Scripted(react=echo)
    world = world_until(0.5, {0.3: Strike("robot1", "kill")})
    play(world, {"robot1": host_of("robot1", robot)})
    assert [now for now, _ in robot.events] == [STEP, 2 * STEP]


def test_a_restarted_robot_begins_anew_with_what_comes_next() -> None:
    robot = Scripted(react=echo)
    world = world_until(0.5, {0.3: Strike("robot1", "restart")})
    play(world, {"robot1": host_of("robot1", robot)})
    assert robot.life == 1
    assert len(robot.events) == 4  # what was sent at the instant of the fault is lost


def test_a_member_that_stops_leaves() -> None:
    robot = Scripted(react=lambda event, now: [Send("body", "world", Ping()), Stop("tired")])
    world = world_until(0.5)
    play(world, {"robot1": host_of("robot1", robot)})
    assert len(robot.events) == 1
    assert [type(event) for _, event in world.events] == [Received, PeerLeft]
