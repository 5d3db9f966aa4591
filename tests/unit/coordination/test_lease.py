from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coordination.lease import Lease, LeaseTerms

TERMS = LeaseTerms(patience=20.0, silence=5.0)


def test_silence_ends_it() -> None:
    lease = Lease(TERMS, 0.0)
    assert lease.violation(4.9) is None
    assert lease.violation(5.0) == "silent for 5 s"


def test_contact_alone_does_not_keep_it() -> None:
    lease = Lease(TERMS, 0.0)
    for t in range(1, 20):
        lease.contact(float(t))
        assert lease.violation(float(t)) is None
    lease.contact(20.0)
    assert lease.violation(20.0) == "no progress for 20 s"


def test_progress_keeps_it() -> None:
    lease = Lease(TERMS, 0.0)
    assert not lease.progress(50.0, 1.0)  # a first word says only that it began
    for t in range(2, 100):
        assert lease.progress(50.0 - 0.5 * t, float(t))
        assert lease.violation(float(t)) is None


def test_jitter_is_no_progress() -> None:
    lease = Lease(TERMS, 0.0)
    for t in range(30):
        assert not lease.progress(10.0 + 0.04 * (-1) ** t, float(t))
    assert lease.violation(29.0) is not None


def test_progress_along_a_detour_counts() -> None:
    lease = Lease(TERMS, 0.0)
    lease.progress(3.0, 1.0)
    assert not lease.progress(40.0, 10.0)
    assert lease.progress(39.5, 11.0)
    lease.contact(30.9)
    assert lease.violation(30.9) is None
    assert lease.violation(31.0) is not None


def test_running_to_and_fro_ends_it() -> None:
    lease = Lease(LeaseTerms(patience=20.0, silence=5.0, detours=2), 0.0)
    times = iter(range(1, 200))
    ended = None
    for _ in range(40):
        for remaining in (3.0, 8.0, 7.0):
            now = float(next(times))
            lease.progress(remaining, now)
            ended = ended or lease.violation(now)
    assert ended is not None


def test_at_its_place_it_only_needs_contact() -> None:
    lease = Lease(LeaseTerms(patience=20.0, silence=5.0, arrived=0.5), 0.0)
    lease.progress(0.4, 1.0)
    lease.contact(1000.0)
    assert lease.violation(1004.0) is None
    assert lease.violation(1005.0) is not None


def test_renewed() -> None:
    lease = Lease(LeaseTerms(patience=1.0, silence=5.0), 0.0)
    lease.renew(0.9)
    assert lease.violation(1.5) is None
    assert lease.deadline == pytest.approx(1.9)


def test_a_robot_that_knows_of_no_way_does_not_get_on() -> None:
    lease = Lease(LeaseTerms(patience=20.0, silence=5.0), 0.0)
    lease.progress(8.0, 1.0)
    assert not lease.progress(0.0, 2.0)
    lease.progress(8.0, 20.0)
    assert lease.violation(20.9) is None
    assert lease.violation(21.0) is not None


reports = st.lists(st.tuples(st.floats(0.01, 4.0), st.floats(0.0, 60.0)), max_size=15)


@settings(deadline=None, max_examples=50)
@given(reports)
def test_the_deadline_is_when_it_ends(steps: list[tuple[float, float]]) -> None:
    lease, now = Lease(TERMS, 0.0), 0.0
    for pause, remaining in steps:
        now += pause
        assert (lease.violation(now) is None) == (now < lease.deadline)
        lease.progress(remaining, now)
        assert lease.deadline <= now + TERMS.silence
