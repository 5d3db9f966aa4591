import json
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser

import pytest

from expedition.results.record import RunRecord
from expedition.results.report import report_html
from expedition.results.summary import summarise
from tests.unit.expedition.records import full_record, nasty_records

VOID = {"meta", "input", "br"}


class _Balanced(HTMLParser):
    """Fails on an end tag that ends nothing; `open` must be empty at the end."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def page(record: RunRecord) -> str:
    return report_html(record, summarise(record))


@pytest.mark.parametrize("name", nasty_records())
def test_every_run_gives_a_whole_page(name: str) -> None:
    html = page(nasty_records()[name])
    parser = _Balanced()
    parser.feed(html)
    assert parser.open == []
    for svg in re.findall(r"<svg.*?</svg>", html, re.S):
        ElementTree.fromstring(svg)
    json.loads(re.findall(r'id="motion">(.*?)</script>', html, re.S)[0])
    assert not re.search(r"\bnan\b|\binf\b", html, re.I)


def test_the_page_needs_nothing_but_itself() -> None:
    html = page(full_record())
    assert not re.search(r"https?://|src=|@import|<link", html)
    assert re.findall(r'href="([^"]{5})', html) == ["data:"] * 3


def test_what_the_page_tells() -> None:
    html = page(full_record())
    assert "auction in room" in html
    assert "2 robots mapped" in html
    assert "Why it ended: nothing left to gain." in html
    assert "too narrow" in html
    assert "1 failed" in html
    assert "stuck &lt;here&gt;" in html
    assert "true walls" in html
    assert "scan_report" in html
    assert "seed = 3" in html
    assert "Please note" not in html


def test_names_from_outside_do_no_harm() -> None:
    assert "<b>bob" not in page(nasty_records()["stray"])


def test_problems_are_shown() -> None:
    record = full_record()
    record.problems = ["a part is <torn>"]
    assert "a part is &lt;torn&gt;" in page(record)


def test_the_end_of_an_unknown_kind() -> None:
    record = RunRecord(ended="exploded")
    assert "it ended in an unknown way" in page(record)
    record.robots = full_record().robots[:1]
    assert "One robot" in page(record)


def test_numbers_on_the_map_only_where_they_can_be_read() -> None:
    assert "numbers as on the map" in page(full_record())
    assert "numbers as on the map" not in page(nasty_records()["many"])


def test_traffic_without_links() -> None:
    record = full_record()
    record.bytes_links = {}
    assert "by link" in page(full_record())
    assert "by link" not in page(record)
