from __future__ import annotations

from protocol.standing import Standing


def test_faults_in_a_short_time_isolate_and_one_line_says_so() -> None:
    standing = Standing(3, 10.0)
    first = standing.fault("eve", "lies: a", 0.0)
    assert [note.text for note in first] == ["dropped words of eve: lies: a"]
    assert standing.fault("eve", "lies: b", 1.0) == []
    (last,) = standing.fault("eve", "lies: c", 2.0)
    assert last.text == "eve is isolated: 3 faults, the last was lies: c"
    assert standing.isolated == {"eve": 2.0}
    assert standing.fault("eve", "lies: d", 3.0) == []
    assert standing.book.counts == {("eve", "lies"): 3}


def test_rare_faults_and_those_of_others_do_not_isolate() -> None:
    standing = Standing(3, 10.0)
    for k in range(20):
        standing.fault("ann", "odd", 6.0 * k)
        standing.fault(f"peer{k}", "odd", 6.0 * k)
    assert standing.isolated == {}


def test_the_books_stay_small() -> None:
    standing = Standing(2, 10.0)
    for k in range(1000):
        standing.fault(f"name{k}", "odd", 0.0)
    for k in range(1000):
        standing.fault(f"name{k}", "odd", 0.0)
    assert len(standing.isolated) <= 256
