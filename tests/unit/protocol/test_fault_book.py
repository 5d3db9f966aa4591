from __future__ import annotations

from protocol.fault_book import FaultBook


def test_a_fault_is_named_once_and_counted_always() -> None:
    book = FaultBook()
    (note,) = book.enter("a frame", "robot1", "not finite: x")
    assert note.text == "dropped a frame of robot1: not finite: x"
    assert book.enter("a frame", "robot1", "not finite: y") == []
    assert book.enter("a frame", "robot2", "not finite: x") != []
    assert book.counts == {("robot1", "not finite"): 2, ("robot2", "not finite"): 1}


def test_the_book_stays_small_whatever_a_peer_invents() -> None:
    book = FaultBook()
    for k in range(300):
        book.enter("a frame", "eve", f"fault {k}")
    assert len(book.counts) == 101
    assert sum(book.counts.values()) == 300
