from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coordination.task import ENDED, LIVE, TRANSITIONS, Task, TaskError, TaskEvent, TaskState


@given(st.sampled_from(TaskState), st.sampled_from(TaskEvent))
def test_every_pair_is_in_the_table_or_an_error(state: TaskState, event: TaskEvent) -> None:
    task = Task(1, "explore", "robin", (0.0, 0.0), state=state)
    if (state, event) in TRANSITIONS:
        assert task.advance(event) is TRANSITIONS[state, event] is task.state
    else:
        with pytest.raises(TaskError, match=f"{state} cannot {event}"):
            task.advance(event)
        assert task.state is state


@given(st.lists(st.sampled_from(TaskEvent), max_size=8))
def test_what_has_ended_stays_ended(events: list[TaskEvent]) -> None:
    task = Task(1, "visit", "robin", (0.0, 0.0))
    for event in events:
        before = task.state
        try:
            task.advance(event)
        except TaskError:
            continue
        assert before not in ENDED


def test_every_state_is_announced_live_or_ended() -> None:
    assert {TaskState.ANNOUNCED, *LIVE, *ENDED} == set(TaskState)
    assert all((state, event) not in TRANSITIONS for state in ENDED for event in TaskEvent)


def test_every_state_but_the_first_can_be_come_to() -> None:
    assert set(TRANSITIONS.values()) == set(TaskState) - {TaskState.ANNOUNCED}


def test_live() -> None:
    task = Task(7, "explore", "robin", (1.0, 2.0), (0.0, 0.0, 2.0, 4.0), 8.0, 3.0)
    assert not task.live
    task.advance(TaskEvent.AWARD)
    assert task.live
    task.advance(TaskEvent.PROGRESS)
    task.advance(TaskEvent.PROGRESS)
    assert task.live
    task.advance(TaskEvent.FINISH)
    assert not task.live
