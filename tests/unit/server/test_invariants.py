from __future__ import annotations

from collections.abc import Callable

import pytest

from protocol.body import Body
from server.executive_settings import ExecutiveSettings
from server.invariants import check
from server.pool import Member, Pool
from server.work import Work


def _explore(work: Work, anna: Member) -> None:
    anna.node.add(work.leaf("anna", "explore", (0.0, 0.0)), 0.0)


def _two(work: Work, anna: Member) -> None:
    _explore(work, anna)
    _explore(work, anna)


def _lost(work: Work, anna: Member) -> None:
    _explore(work, anna)
    anna.live = False


def _paused(work: Work, anna: Member) -> None:
    _explore(work, anna)
    anna.mode = "pause"


def _idle(work: Work, anna: Member) -> None:
    _explore(work, anna)
    anna.idle_since = 0.0


def _not_its_own(work: Work, anna: Member) -> None:
    anna.node.add(work.leaf("ben", "explore", (0.0, 0.0)), 0.0)


def _over(work: Work, anna: Member) -> None:
    work.mission.terminate("over", 0.0)


def _gone(work: Work, anna: Member) -> None:
    anna.node.terminate("over", 0.0)


def _twice(work: Work, anna: Member) -> None:
    leaf = work.leaf("anna", "explore", (0.0, 0.0))
    work.note(0.0, "awarded", "anna", leaf.task)
    work.note(0.0, "awarded", "anna", leaf.task)


def _elsewhere(work: Work, anna: Member) -> None:
    work.new_robot("ben", 0.0).add(work.leaf("ben", "explore", (0.0, 0.0)), 0.0)


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (_two, "anna has 2 tasks"),
        (_lost, "lost and has a task"),
        (_paused, "mode pause and at a explore"),
        (_idle, "explores and is idle"),
        (_not_its_own, "another's task"),
        (_over, "mission's node"),
        (_gone, "anna's node"),
        (_twice, "given twice"),
        (_elsewhere, "a lease without"),
    ],
)
def test_each_is_noticed(spoil: Callable[[Work, Member], None], complaint: str) -> None:
    work, pool = Work(ExecutiveSettings()), Pool()
    anna = Member("anna", Body(), work.new_robot("anna", 0.0), 0.0)
    pool.add(anna)
    check(pool, work)
    spoil(work, anna)
    with pytest.raises(AssertionError, match=complaint):
        check(pool, work)
