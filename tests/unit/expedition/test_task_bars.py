from expedition.results.task_bars import task_bars
from tests.unit.expedition.records import full_record, task


def test_bars_of_a_run() -> None:
    bars = task_bars(full_record().tasks, 8.0)
    assert [(b.robot, b.kind, b.start, b.end, b.outcome, b.failed) for b in bars] == [
        ("ada", "explore", 0.0, 3.0, "failed", True),
        ("bob", "visit", 0.0, 4.0, "terminated", False),
        ("bob", "juggle", 5.0, 8.0, "", False),
    ]
    assert bars[0].goal == (1.0, 1.0)
    assert bars[0].reason == "stuck <here>"
    assert bars[2].goal is None


def test_odd_events() -> None:
    events = [
        task(1.0, "done", "a", 1),  # never awarded
        task(2.0, "award", "a", 2),
        task(3.0, "progress", "a", 2),
        task(4.0, "award", "a", 2),  # again
        task(5.0, "finish", "a", 2),
        task(20.0, "award", "a", 3),  # after the end
        {"event": "award"},
    ]
    bars = task_bars(events, 10.0)
    assert [(b.task, b.start, b.end, b.outcome) for b in bars] == [
        ("", 0.0, 10.0, ""),
        ("2", 2.0, 4.0, "terminated"),
        ("2", 4.0, 5.0, "done"),
        ("3", 20.0, 20.0, ""),
    ]
