"""Two robots in one room, each of which drew a piece of its map."""

from __future__ import annotations

from typing import Any

import pytest

from mapping.geometry import Pose2
from protocol import messages as words
from protocol import operator_messages as asks
from protocol.body import Body
from protocol.effects import Effect, Note, Send
from server.settings import MapSettings
from tests.unit.server.master_rig import Rig, notes, of_type

# So strict that nothing is firm.
STRICT = {"loose_m": 1e-4}


def team(**of_map: Any) -> Rig:
    """Both are tied to the map, and see nothing left to explore."""
    rig = Rig(map=MapSettings(**of_map))
    rig.tick(0.0)
    for name, start in (("robot1", [0.0, 0.0, 0.0]), ("robot2", [0.4, 0.2, 0.0])):
        rig.hello(name, body=Body(radius_m=0.2).model_dump(), start=start)
        rig.beat(name, Pose2(0.0, 0.0, 0.0))
        for number in range(1, 7):
            rig.report(name, number, Pose2(0.02 * number, 0.0, 0.1 * number))
            rig.tick()
    return rig


def until_the_end(rig: Rig, seconds: float = 12.0, arrive: bool = True) -> list[Effect]:
    """Both bid for nothing, and arrive at once where they are sent; return all that is sent."""
    effects: list[Effect] = []
    numbers = 100
    for _ in range(round(seconds)):
        for name in ("robot1", "robot2"):
            numbers += 1
            rig.beat(name)
            effects += rig.bid(name, numbers, gain=0.0)
        effects += rig.tick(1.0)
        for name in ("robot1", "robot2"):
            for award in of_type(effects, words.Award, name)[-1:] if arrive else []:
                end = words.TaskEnd(task=award.task, outcome="done", reason="")
                effects += rig.says(name, end)
    return effects


def test_a_loose_seam_is_looked_at_once_before_the_end() -> None:
    rig = team(**STRICT)
    assert len(rig.master.merger.team.submaps) >= 2
    effects = until_the_end(rig)
    visits = [award for award in of_type(effects, words.Award) if award.kind == "visit"]
    assert len({award.task for award in visits}) == 1
    assert "hang loosely together" in notes(effects)
    assert rig.master.ended == "explored"


@pytest.mark.parametrize("of_map", [{}, STRICT | {"last_looks": 0}])
def test_a_firm_map_and_an_impatient_team_just_end(of_map: dict[str, Any]) -> None:
    rig = team(**of_map)
    effects = until_the_end(rig)
    assert "hang loosely" not in notes([e for e in effects if isinstance(e, Note)])
    assert rig.master.ended == "explored"


def test_a_robot_that_does_not_arrive_is_called_back_and_the_mission_ends() -> None:
    rig = team(**STRICT, look_s=5.0)
    effects = until_the_end(rig, 9.0, arrive=False)
    (visit,) = {a.task for a in of_type(effects, words.Award) if a.kind == "visit"}
    assert rig.master.ended is None
    effects = until_the_end(rig, 10.0, arrive=False)
    assert visit in {end.task for end in of_type(effects, words.Terminate)}
    assert rig.master.ended == "explored"


def test_a_look_that_an_operator_broke_off_is_not_called_back() -> None:
    rig = team(**STRICT, look_s=5.0)
    effects = until_the_end(rig, 6.0, arrive=False)
    (robot,) = {a.to for a in effects if isinstance(a, Send) and _is_visit(a)}
    rig.hello("boss", "operator")
    rig.says("boss", asks.PauseRequest(robot=robot))
    until_the_end(rig, 8.0, arrive=False)
    assert rig.master.executive.mode(robot) == "pause"


def _is_visit(send: Send) -> bool:
    return isinstance(send.message, words.Award) and send.message.kind == "visit"
