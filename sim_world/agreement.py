"""When the mission of a team is over whose robots decide for themselves.

Each robot says when it finds nothing more to do, and takes that back when it learns better: parted
from the others it cannot know what they found. So the word of one of them ends nothing. People who
call the robots in can count them: the mission is over when all robots that are there say so and
hold the same.
"""

from __future__ import annotations

from collections.abc import Sequence

from protocol.world_messages import Through


class Agreement:
    """What the members of a team last said of the end of their mission.

    Args:
        patience: when all are through, but do not come to hold the same, the mission is over after
            so long [s].
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._words: dict[str, Through] = {}
        self._differ_since: float | None = None

    def hear(self, name: str, word: Through) -> None:
        """Take a member's word, in place of the one before."""
        self._words[name] = word

    def forget(self, name: str) -> None:
        """A member starts anew: what it said before does not count any more."""
        self._words.pop(name, None)

    def over(self, present: Sequence[str], now: float) -> str:
        """Return why the mission is over; empty while it is not.

        Args:
            present: names of all members that are there.
            now: mission time [s].
        """
        words = {name: self._words.get(name) for name in present}
        counted = [words[name] for name in present if not self._is_shut_out(name, words)]
        if not counted or not all(word is not None and word.through for word in counted):
            self._differ_since = None
            return ""
        if len({word.held for word in counted if word is not None}) == 1:
            return "nothing useful is left, and all hold the same"
        if self._differ_since is None:
            self._differ_since = now
        if now - self._differ_since < self._patience:
            return ""
        return f"all are through, but parted: for {self._patience:g} s they held different maps"

    def _is_shut_out(self, name: str, words: dict[str, Through | None]) -> bool:
        """Whether most of the others do not listen to a member any more."""
        others = [word for other, word in words.items() if other != name]
        against = sum(word is not None and name in word.shut_out for word in others)
        return 2 * against > len(others)
