from __future__ import annotations

from mapping.geometry import Pose2
from robot_agent.look_around import LookAround


def test_a_whole_turn_is_wanted_whichever_way() -> None:
    look = LookAround(wanted=True)
    for k in range(8):
        assert look.first and not look.done
        look.follow(Pose2(0.0, 0.0, -0.8 * k))
    look.follow(Pose2(0.0, 0.0, -6.4))
    assert look.done and not look.first


def test_who_need_not_look_is_done_at_once() -> None:
    look = LookAround(wanted=False)
    assert look.done and look.first
