"""Where a robot that is not tied yet may be: where others saw it, and where it was told."""

from __future__ import annotations

import numpy as np

from mapping.motion_model import MotionModel
from mapping.mutual_sightings import MutualSightings
from server.placing import Member
from server.tying import guesses
from tests.unit.seen_starts import ERRORS, STARTS, sightings, told_start


def member(name: str, aligned: bool) -> Member:
    told = told_start(name, exactly=aligned)
    return Member(told, np.diag([0.1, 0.1, 0.03]), ERRORS, MotionModel(), aligned=aligned)


def test_what_was_told_stands_beside_what_was_seen() -> None:
    members = {name: member(name, name == "a") for name in STARTS}
    seen, told = guesses("b", members, sightings())
    assert seen.seen and seen.T_map_odom.distance_to(STARTS["b"]) < 1e-9
    assert not told.seen and told.T_map_odom == members["b"].T_map_odom
    alone = list(guesses("b", members, MutualSightings()))
    assert [guess.seen for guess in alone] == [False]
