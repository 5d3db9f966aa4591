from expedition.results.report_tables import MOST_ROWS, bytes_card, remaining_card, robots_card
from expedition.results.summary import summarise
from expedition.results.task_bars import task_bars
from tests.unit.expedition.records import full_record


def test_robots() -> None:
    record = full_record()
    html = robots_card(summarise(record), task_bars(record.tasks, 8.0))
    assert html.index("ada") < html.index("bob")
    assert "1 failed" in html and "4.5 m" in html
    assert "No robot took part" in robots_card({"robots": []}, [])


def test_what_was_left() -> None:
    many = [{"x_m": 1.0, "y_m": 2.0, "reason": f"<{i}>"} for i in range(MOST_ROWS + 5)]
    html = remaining_card({"remaining": many})
    assert html.count("<tr>") == MOST_ROWS + 1
    assert f"{MOST_ROWS + 5} places" in html
    assert "&lt;0&gt;" in html
    assert "No place was reported" in remaining_card({"remaining": []})


def test_traffic_has_the_largest_first() -> None:
    html = bytes_card(summarise(full_record()))
    assert html.index("scan_report") < html.index("bid<")
    assert html.count('class="bar"') == 3
    nothing = {"bytes": {"bid": {"count": 0, "bytes": 0}}, "bytes_links": {}, "links": {}}
    assert "width:0.0%" in bytes_card(nothing)


def test_frames_that_did_not_arrive_are_told() -> None:
    summary = summarise(full_record())
    assert "lost" not in bytes_card(summary)
    for queued, late in ((0, "."), (3, ", 3 were still on their way at the end.")):
        link = {"sent": {"count": 5000}, "lost": {"count": 1200}, "queued": {"count": queued}}
        assert f"1,200 of 5,000 frames were lost{late}" in bytes_card(
            {**summary, "links": {"a": link}}
        )
