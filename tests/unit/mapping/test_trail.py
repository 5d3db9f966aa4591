"""A robot's own map tells of longer pieces of its way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Floats, Pose2
from mapping.scan import LaserScan
from mapping.trail import Span, Trail, _blind_part
from mapping.way import Report, Way

SCAN = LaserScan(np.ones(1, dtype=np.float32), 0.0, 0.1, 5.0, 0.0)
SURE = np.diag([1e-4, 1e-4, 1e-5])
SEEN = np.diag([1e-4, 1e-4, 1e-5])
BLIND = np.diag([0.01, 0.01, math.radians(5.0) ** 2])


def report(x: float) -> Report:
    return Report(SCAN, Pose2(x, 0.0, 0.0), SURE, np.zeros((0, 4)))


def way(error: Floats = SEEN, by_wheels: bool = False) -> Way:
    return Way(Pose2(1.0, 0.0, 0.0), SURE, error, by_wheels)


def driven(trail: Trail, metres: int, **of_way: object) -> list[Span]:
    """Drive straight on, a node for each metre; return all spans told of."""
    trail.begin(0, report(0.0))
    spans = []
    for k in range(1, metres + 1):
        spans += trail.add(k, report(float(k)), way(**of_way))  # type: ignore[arg-type]
    return spans


def test_a_span_is_told_of_once_it_is_long_enough_and_not_at_every_step() -> None:
    spans = driven(Trail((8.0,)), 13)
    assert [span.first for span in spans] == [0, 2, 4]
    for span in spans:
        assert span.T_first_last.x == pytest.approx(8.0)
        assert np.linalg.eigvalsh(span.information)[0] > -1e-6


def test_a_span_tells_more_than_its_steps_added_up_but_nothing_where_it_was_blind() -> None:
    (seen,) = driven(Trail((4.0,)), 4)
    (blind,) = driven(Trail((4.0,)), 4, error=BLIND)
    heading_of_steps = 1.0 / (4 * SEEN[2, 2])
    assert 4.0 * seen.information[2, 2] > heading_of_steps  # four of them overlap everywhere
    heading_of_steps = 1.0 / (4 * BLIND[2, 2])
    assert blind.information[2, 2] < 0.1 * heading_of_steps


def test_no_span_leads_past_a_place_where_only_the_wheels_count() -> None:
    trail = Trail((2.0,))
    assert len(driven(trail, 2)) == 1
    assert trail.add(3, report(3.0), way(by_wheels=True)) == []
    assert trail.add(4, report(4.0), way()) == []
    assert [span.first for span in trail.add(5, report(5.0), way())] == [3]


def test_lengths_do_not_hinder_each_other_and_old_stops_are_forgotten() -> None:
    trail = Trail((16.0, 4.0))
    spans = driven(trail, 60)
    lengths = {round(span.T_first_last.x) for span in spans}
    assert lengths == {4, 16}
    assert len(trail._stops) < 20
    assert driven(Trail(()), 5) == []


def test_a_step_that_is_seen_well_is_not_blind() -> None:
    assert _blind_part(np.diag([1e-4, 1e-4, 1e-5])) == pytest.approx(np.zeros((3, 3)))
    some = _blind_part(np.diag([1e-4, 0.04, 1e-5]))
    assert some[1, 1] == pytest.approx(0.04, rel=0.05)
    assert some[0, 0] == pytest.approx(0.0)
