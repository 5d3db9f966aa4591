from __future__ import annotations

from coordination.waiting_place import IdleRobot
from mapping.geometry import Floats
from tests.unit.server.executive_rig import Rig, awards


class Chooser:
    """Sends every idle robot to one place on the x axis, and remembers what it was asked."""

    def __init__(self, x: float) -> None:
        self.x = x
        self.asked: list[tuple[list[str], list[float]]] = []

    def __call__(
        self, idle: tuple[IdleRobot, ...], places: Floats, gains: Floats
    ) -> dict[str, tuple[float, float]]:
        self.asked.append(([robot.robot for robot in idle], places[:, 0].tolist()))
        return {robot.robot: (self.x, 0.0) for robot in idle} | {"zoe": (0.0, 0.0)}


def team(choose: Chooser) -> Rig:
    # Nobody knows where carl is: he never bids.
    rig = Rig("anna", "ben", "carl", choose=choose, probe_s=99.0)
    rig.bid("anna", (5, 20, 2), (30, 0.1, 9))
    rig.bid("ben", (5, 20, 8), (30, 0.1, 9))
    rig.wait(0.4, "anna", "ben", "carl")
    assert rig.goals() == {"anna": 5}
    return rig


def test_an_idle_robot_is_sent_to_wait_and_called_off() -> None:
    choose = Chooser(10.0)
    rig = team(choose)
    rig.progress("anna", 4.0)
    assert awards(rig.wait(1.5, "anna", "ben")) == []
    assert awards(rig.wait(1.0, "anna", "ben")) == [("ben", "wait", 10)]
    assert choose.asked == [(["ben"], [5.0])]  # 30 has too little to gain
    rig.progress("ben", 9.0)
    assert awards(rig.wait(11.0, "anna", "ben")) == []  # it goes there already
    assert len(choose.asked) == 3
    assert not rig.executive.exhausted(rig.now)
    rig.new_map()
    rig.bid("ben", (40, 20, 8))
    assert awards(rig.wait(0.4, "anna", "ben")) == [("ben", "explore", 40)]


def test_a_short_move_is_not_worth_it() -> None:
    rig = team(Chooser(1.0))
    rig.progress("anna", 4.0)
    assert awards(rig.wait(8.0, "anna", "ben")) == []


def test_another_place_is_worth_it_if_it_is_far_enough() -> None:
    choose = Chooser(10.0)
    rig = team(choose)
    rig.progress("anna", 4.0)
    rig.wait(2.5, "anna", "ben")
    rig.end("ben")
    choose.x = -10.0
    assert awards(rig.wait(5.0, "anna", "ben")) == [("ben", "wait", -10)]


def test_a_place_it_cannot_get_to_is_not_asked_for_again() -> None:
    rig = team(Chooser(10.0))
    rig.progress("anna", 4.0)
    rig.wait(2.5, "anna", "ben")
    rig.end("ben", "unreachable")
    assert awards(rig.wait(11.0, "anna", "ben")) == []
    assert rig.executive.remaining() != []


def test_without_places_nobody_moves() -> None:
    choose = Chooser(10.0)
    rig = Rig("anna", choose=choose)
    rig.bid("anna")
    rig.wait(8.0, "anna")
    assert choose.asked == []


def test_a_robot_left_out_does_not_wait() -> None:
    choose = Chooser(10.0)
    rig = Rig("anna", choose=choose, lease_s=1.0, expiries_max=1)
    rig.bid("anna", (5, 20, 2))
    rig.wait(8.0, "anna")
    assert rig.events("left out") == [("left out", "anna")]
    assert choose.asked == []


def test_without_a_chooser_everybody_stays() -> None:
    rig = Rig("anna")
    rig.bid("anna", (5, 0.1, 2))
    assert awards(rig.wait(8.0, "anna")) == []
