"""The page on messages is what the messages say: the wire cannot change unnoticed."""

from __future__ import annotations

from docs.generate_messages import PAGE, page
from protocol.codec import KINDS


def test_the_page_is_up_to_date() -> None:
    same = PAGE.read_text(encoding="utf-8") == page()
    assert same, "run `python docs/generate_messages.py` and look at what changed"


def test_the_page_names_every_type() -> None:
    text = page()
    assert all(f"### `{name}`\n" in text for name in KINDS)
