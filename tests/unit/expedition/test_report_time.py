import numpy as np
import pytest

from expedition.results.record import RunRecord
from expedition.results.report_time import LEFT, RIGHT, TimeAxis, time_svg
from expedition.results.summary import summarise
from expedition.results.task_bars import task_bars
from tests.unit.expedition.records import full_record


def test_the_axis_keeps_to_its_ends() -> None:
    axis = TimeAxis(10.0, "s")
    assert [axis.x(t) for t in (-5.0, 0.0, 5.0, 10.0, 50.0)] == [
        LEFT, LEFT, 0.5 * (LEFT + RIGHT), RIGHT, RIGHT,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("end", "unit", "last", "title"),
    [
        (40.0, "s", "40", "mission time [s]"),
        (900.0, "s", "14:00", "mission time [min:s]"),
        (1.0e6, "s", "14400:00", "mission time [min:s]"),
        (5000.0, "steps", "5000", "steps"),
        (0.001, "s", "0.001", "mission time [s]"),
    ],
)
def test_ticks(end: float, unit: str, last: str, title: str) -> None:
    axis = TimeAxis(end, unit)
    ticks = axis.ticks()
    assert 5 <= len(ticks) <= 17
    assert ticks[-1][1] == last
    assert axis.title == title


def drawn(record: RunRecord) -> str:
    return time_svg(record, summarise(record), task_bars(record.tasks, 8.0), 8.0)


def test_tasks_faults_and_levels() -> None:
    svg = drawn(full_record())
    assert svg.count("<rect") == 3
    assert "freeze at 3.0 s" in svg
    assert "lost at 6.0 s" in svg
    assert "stuck &lt;here&gt;" in svg
    assert ">t50<" in svg and ">t90<" in svg
    assert "90 % after 4.0 s" in svg
    assert "99 % after" in svg and ">t99<" in svg


def test_crowded_levels_share_a_label() -> None:
    record = full_record()
    record.coverage_timeline = np.array([[0.0, 0.0], [0.1, 1.0], [8.0, 1.0]])
    svg = drawn(record)
    assert svg.count(">t50<") == 1
    assert ">t90<" not in svg
    assert "90 % after 0.1 s" in svg


def test_a_long_timeline_is_thinned_and_an_empty_one_said() -> None:
    record = full_record()
    t = np.linspace(0.0, 8.0, 10_000)
    record.coverage_timeline = np.column_stack((t, t / 8.0))
    assert len(drawn(record)) < 60_000
    assert "no coverage was measured" in drawn(RunRecord())
