"""What must hold of a member's log and its synchronisation between any two events."""

from __future__ import annotations

from protocol.log.sync import LogSync


def check(sync: LogSync, now: float) -> None:
    """Check it, in a time that does not grow with the log.

    Raises:
        AssertionError: something does not hold.
    """
    settings, log = sync.settings, sync.log
    assert sync.next_deadline() > now, "something is due that the tick did not do"
    assert len(log.logs) <= settings.authors_most
    for author in log.authors():
        held = log.of(author)
        assert 0 <= held.count <= len(held.entries) <= held.top
        assert held.count + 1 not in held.entries, "the count is behind"
        assert len(held.entries) - held.count == sum(b - a + 1 for a, b in held.beyond())
        assert held.top <= held.count + settings.window_entries
        assert held.bytes <= settings.author_bytes_most
    assert log.own.count == log.own.top, "a gap in one's own log"
    waiting = [asked for asked in sync.asking.asked.values() if asked.deadline > now]
    assert len(waiting) <= settings.request_entries
    assert all(wanted for wanted in sync.answering.wanted.values())
    assert all(len(w) <= 2 * settings.request_entries + 1 for w in sync.answering.wanted.values())
    for name in sorted(sync.standing.isolated):
        assert name not in sync.peers.known and name not in sync.answering.wanted
