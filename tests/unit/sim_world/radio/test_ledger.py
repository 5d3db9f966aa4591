from __future__ import annotations

from sim_world.radio.ledger import Ledger, Tally, enter


def test_a_book_counts_frames_and_bytes_of_each_line() -> None:
    ledger = Ledger()
    enter(ledger.sent, ("a", "b", "bid"), 8)
    enter(ledger.sent, ("a", "b", "bid"), 4)
    enter(ledger.sent, ("a", "c", "bid"), 1)
    enter(ledger.aired, ("a", "bid"), 8)
    assert ledger.sent == {("a", "b", "bid"): Tally(2, 12), ("a", "c", "bid"): Tally(1, 1)}
    assert ledger.aired == {("a", "bid"): Tally(1, 8)}
    assert ledger.lost == {}
