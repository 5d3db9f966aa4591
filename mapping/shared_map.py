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

from mapping.geometry import Pose2
from mapping.grid import EMPTY_BOX, CellBox, GridGeometry
from mapping.observation_coding import Observation, ObservationError, decode_observation
from mapping.scan import LaserScan
from mapping.scan_layout import KNOWN_LAYOUTS, SensorLayout
from mapping.team_map import TeamMap

Author = tuple[str, int]  # a robot's name, and which life of it


class Held(Protocol):
    """A copy of the team's observations, as bytes, and what has changed in it."""

    def payload(self, author: Author, number: int) -> bytes:
        """Return the bytes of an entry that is held."""
        ...

    def told_at(self, author: Author, number: int) -> Pose2:
        """Return where an entry was made, as its author first said, map frame."""
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
        return box, self.log_odds[box.shifted(*(-n for n in lattice_of(self.geometry))).slices]

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

        Args:
            held: the copy.
            entries: that are new.
            repositioned: authors whose entries were told other places.
            forgotten: authors that are not there any more; this goes first.
        """
        for author in forgotten:
            self._forget(author)
        entries = list(entries)
        bad, moved = [], dict.fromkeys(repositioned)
        poses = {
            author: held.poses(author) for author in {**moved, **{a: None for a, _ in entries}}
        }
        replaced = dict.fromkeys(author for author, n in entries if (author, n) in self.told)
        for author in replaced:  # a layer takes each number once
            self.team.forget(author)
        for author, number in entries:
            self.told[author, number] = held.told_at(author, number)
            reason = self._observe(author, number, held.payload(author, number), poses[author])
            if reason is not None:
                bad.append(((author, number), reason))
        for author in replaced:
            self._draw_again(author, poses[author])
        for author in moved:
            self.team.place(author, poses[author])
        return bad

    def draw(self) -> None:
        """Bring the grid up to date, and tell all views what changed."""
        box = self.team.take_changes()
        if not box.empty:
            box = box.shifted(*lattice_of(self.team.grid().geometry))
        for view in self._views:
            view.note(box)

    def scans(self, author: Author, since: int) -> Iterable[tuple[LaserScan, Pose2]]:
        """Yield all scans but those of an author after number `since`, with poses, map frame."""
        for placed in self.team.placed():
            if placed.author != author or placed.number <= since:
                yield placed.scan, placed.T_map_base

    def _observe(
        self, author: Author, number: int, payload: bytes, poses: Mapping[int, Pose2]
    ) -> str | None:
        """Take in an entry; return why it cannot be drawn, None if it can."""
        try:
            observation = decode_observation(payload, self._layouts)
        except ObservationError as error:
            self.unreadable[author, number] = str(error)
            self.observations.pop((author, number), None)
            return str(error)
        self.observations[author, number] = observation
        self.unreadable.pop((author, number), None)
        on_map = self.team.observe(author, number, observation.scan, poses[number])
        return None if on_map else "a scan beyond the edge of the largest map"

    def _draw_again(self, author: Author, poses: Mapping[int, Pose2]) -> None:
        """Draw all that is held of an author, of which something turned out to be different."""
        for key in sorted(key for key in self.observations if key[0] == author):
            self.team.observe(author, key[1], self.observations[key].scan, poses[key[1]])
        self.team.place(author, poses)

    def _forget(self, author: Author) -> None:
        """Take an author out of the map."""
        books: list[dict[tuple[Author, int], Any]]
        books = [self.observations, self.told, self.unreadable]
        for book in books:
            for key in [key for key in book if key[0] == author]:
                del book[key]
        self.team.forget(author)


def lattice_of(geometry: GridGeometry) -> tuple[int, int]:
    """Return row and column of a grid's first cell on the lattice of cells through (0, 0)."""
    return (
        round(geometry.origin_y / geometry.resolution),
        round(geometry.origin_x / geometry.resolution),
    )
