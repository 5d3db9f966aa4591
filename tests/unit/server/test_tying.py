"""Where a robot that is not tied yet may be: where others saw it, and where it was told."""

from __future__ import annotations

import numpy as np

from mapping.geometry import IDENTITY, Pose2
from mapping.motion_model import MotionModel
from mapping.mutual_sightings import MutualSightings
from server.placing import Member
from server.tying import guesses

STARTS = {"a": Pose2(0.0, 0.0, 0.0), "b": Pose2(1.0, 0.2, 0.3), "c": Pose2(2.2, -0.1, -0.2)}
SEES = {"a": "b", "b": "ac", "c": "b"}


def member(name: str, aligned: bool) -> Member:
    start = STARTS[name]
    told = start if aligned else Pose2(start.x + 0.4, start.y - 0.3, start.theta + 0.2)
    return Member(told, np.diag([0.1, 0.1, 0.03]), (1.0, 0.35), MotionModel(), aligned=aligned)


def sightings() -> MutualSightings:
    seen = MutualSightings()
    for name, others in SEES.items():
        places = [STARTS[name].inverse().apply((STARTS[o].x, STARTS[o].y)) for o in others]
        for _ in range(2):
            seen.add(name, IDENTITY, np.zeros((3, 3)), np.array(places))
    return seen


def test_what_was_told_stands_beside_what_was_seen() -> None:
    members = {name: member(name, name == "a") for name in STARTS}
    seen, told = guesses("b", members, sightings())
    assert seen.seen and seen.T_map_odom.distance_to(STARTS["b"]) < 1e-9
    assert not told.seen and told.T_map_odom == members["b"].T_map_odom
    alone = list(guesses("b", members, MutualSightings()))
    assert [guess.seen for guess in alone] == [False]
