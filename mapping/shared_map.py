"""The map that each member of a team draws from everybody's observations.

Source: Pfingsthorn et al. 2007, section 2: "Each robot also merges all received information from
all other robots into its own pose graph map m_i. Therefore, each robot's map m_i is equivalent to
the global map m_G."
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.geometry import Pose2
from mapping.grid import GridGeometry
from mapping.observation_coding import Observation, ObservationError, decode_observation
from mapping.scan_layout import KNOWN_LAYOUTS, SensorLayout
from mapping.team_map import PlacedScan, TeamMap

Author = tuple[str, int]  # a robot's name, and which life of it


class Held(Protocol):
    """A copy of the team's observations, as bytes, and what has changed in it."""

    def payload(self, author: Author, number: int) -> bytes:
        """Return the bytes of an entry that is held."""
        ...

    def told_at(self, author: Author, number: int) -> Pose2:
        """Return where an entry was made, as its author first said, map frame."""
        ...

    def pose(self, author: Author, number: int) -> Pose2:
        """Return where an entry was made, by the newest word on it, map frame."""
        ...

    def poses(self, author: Author) -> Mapping[int, Pose2]:
        """Return where the entries of an author were made, by the newest word on it, map frame."""
        ...


class MapView:
    """The map as one of those who follow it sees it: it knows what has changed for them."""

    def __init__(self, shared: SharedMap) -> None:
        self._shared = shared
        self._changed = EMPTY_BOX  # on the lattice

    @property
    def geometry(self) -> GridGeometry:
        """Where the map lies, map frame."""
        return self._shared.team.grid().geometry

    @property
    def log_odds(self) -> npt.NDArray[np.float32]:
        """The map, (rows, cols) float32."""
        return self._shared.team.grid().log_odds

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        """Return the box that changed since the last call, on the lattice, and its log-odds."""
        self._shared.draw()
        box, self._changed = self._changed, EMPTY_BOX
        return box, self.log_odds[box.shifted(*(-n for n in self.geometry.lattice)).slices]

    def note(self, box: CellBox) -> None:
        """Note that a box of the lattice has changed."""
        self._changed = self._changed.union(box)


class SharedMap:
    """All observations that are held, where they were made, and the grid drawn of them.

    Args:
        team: draws the scans of all authors.
        layouts: lasers that coded scans name by a number; the same at all members.

    Attributes:
        team: see above.
        observations: by author and number, what was decoded.
        told: by author and number, where the author first said that it was, map frame.
        unreadable: why an entry is not drawn, by author and number: nobody draws it.
    """

    def __init__(
        self, team: TeamMap[Author], layouts: Sequence[SensorLayout] = KNOWN_LAYOUTS
    ) -> None:
        self.team = team
        self.observations: dict[tuple[Author, int], Observation] = {}
        self.told: dict[tuple[Author, int], Pose2] = {}
        self.unreadable: dict[tuple[Author, int], str] = {}
        self._layouts = tuple(layouts)
        self._views: list[MapView] = []

    def view(self) -> MapView:
        """Return a view for somebody who follows the map from its beginning on."""
        view = MapView(self)
        self._views.append(view)
        return view

    def take_in(
        self,
        held: Held,
        entries: Iterable[tuple[Author, int]],
        repositioned: Iterable[Author],
        forgotten: Iterable[Author] = (),
    ) -> list[tuple[tuple[Author, int], str]]:
        """Follow what has changed in the copy; return the new entries that cannot be read, and why.

        A scan beyond the edge of the largest map can be read: all leave it out, and nobody is to
        blame.

        Args:
            held: the copy.
            entries: that are new, or hold something else than they did.
            repositioned: authors whose entries were told other places.
            forgotten: authors that are not there any more; this goes first.
        """
        for author in forgotten:
            self._forget(author)
        bad, changed = [], list(entries)
        replaced = [key for key in changed if key in self.told]
        for author in dict.fromkeys(author for author, _ in replaced):
            self._withdraw(author, [n for a, n in replaced if a == author], held)
        for author, number in changed:
            self.told[author, number] = held.told_at(author, number)
            reason = self._observe(author, number, held)
            if reason is not None:
                bad.append(((author, number), reason))
        for author in dict.fromkeys(repositioned):
            poses = held.poses(author)
            self.team.place(author, poses)
            for key in [(author, number) for number in poses if (author, number) in self.told]:
                self.told[key] = held.told_at(*key)  # until it is told, its author may change it
        return bad

    def draw(self) -> None:
        """Bring the grid up to date, and tell all views what changed."""
        box = self.team.take_changes()
        if not box.empty:
            box = box.shifted(*self.team.grid().geometry.lattice)
        for view in self._views:
            view.note(box)

    def scans(self, author: Author, since: int) -> Iterable[PlacedScan[Author]]:
        """Yield all scans but those of an author after number `since`, by author and number."""
        for placed in self.team.placed():
            if placed.author != author or placed.number <= since:
                yield placed

    def _observe(self, author: Author, number: int, held: Held) -> str | None:
        """Take in an entry; return why it cannot be drawn, None if it can."""
        try:
            observation = decode_observation(held.payload(author, number), self._layouts)
        except ObservationError as error:
            self.unreadable[author, number] = str(error)
            return str(error)
        self.observations[author, number] = observation
        self.team.observe(author, number, observation.scan, held.pose(author, number))
        return None

    def _withdraw(self, author: Author, numbers: list[int], held: Held) -> None:
        """Take some entries of an author off the map again: what they held was wrong.

        That is rare, so the author's layer is simply made anew.
        """
        for number in numbers:
            self.observations.pop((author, number), None)
            self.unreadable.pop((author, number), None)
        self.team.forget(author)
        for (name, number), seen in self.observations.items():
            if name == author:
                self.team.observe(author, number, seen.scan, held.pose(author, number))

    def _forget(self, author: Author) -> None:
        """Take an author out of the map."""
        books: list[dict[tuple[Author, int], Any]]
        books = [self.observations, self.told, self.unreadable]
        for book in books:
            for key in [key for key in book if key[0] == author]:
                del book[key]
        self.team.forget(author)
