"""The map that each member of a team draws from everybody's observations.

Source: Pfingsthorn et al. 2007, section 2: "Each robot also merges all received information from
all other robots into its own pose graph map m_i. Therefore, each robot's map m_i is equivalent to
the global map m_G."
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mapping.geometry import Pose2
from mapping.grid import EMPTY_BOX, CellBox, GridGeometry
from mapping.observation_coding import Observation, ObservationError, decode_observation
from mapping.team_map import Author, TeamMap


class MapView:
    """The map as one of those who follow it sees it: it knows what has changed for them."""

    def __init__(self, shared: SharedMap) -> None:
        self._shared = shared
        self._changed = EMPTY_BOX  # on the lattice

    @property
    def geometry(self) -> GridGeometry:
        """Where the map lies, map frame."""
        return self._shared.geometry

    @property
    def log_odds(self) -> npt.NDArray[np.float32]:
        """The map, (rows, cols) float32."""
        return self._shared.log_odds

    def take_changes(self) -> tuple[CellBox, npt.NDArray[np.float32]]:
        """Return the box that changed since the last call, on the lattice, and its log-odds."""
        self._shared.draw()
        box, self._changed = self._changed, EMPTY_BOX
        rows, cols = self._shared.lattice
        return box, self.log_odds[box.shifted(-rows, -cols).slices]

    def note(self, box: CellBox) -> None:
        """Note that a box of the lattice has changed."""
        self._changed = self._changed.union(box)


class SharedMap:
    """All observations that are held, where they were made, and the grid drawn of them.

    Attributes:
        team: the scans of all authors.
        observations: by author and number, what was decoded.
        unreadable: entries that hold no observation; nobody draws them.
    """

    def __init__(self, team: TeamMap) -> None:
        self.team = team
        self.observations: dict[tuple[Author, int], Observation] = {}
        self.unreadable: dict[tuple[Author, int], str] = {}
        self._views: list[MapView] = []

    def view(self) -> MapView:
        """Return a view for somebody who follows the map from now on."""
        view = MapView(self)
        view.note(self._lattice_box(self.team.grid().geometry.box))
        self._views.append(view)
        return view

    def observe(self, author: Author, number: int, payload: bytes, T_map_base: Pose2) -> str | None:
        """Take in an entry; return why it cannot be drawn, None if it can."""
        try:
            observation = decode_observation(payload)
        except ObservationError as error:
            self.unreadable[author, number] = str(error)
            return str(error)
        if not self.team.observe(author, number, observation.scan, T_map_base):
            self.unreadable[author, number] = "too far away"
            return "an observation too far away from all others"
        self.observations[author, number] = observation
        return None

    def draw(self) -> None:
        """Bring the grid up to date, and tell all views what changed."""
        box = self._lattice_box(self.team.take_changes())
        for view in self._views:
            view.note(box)

    @property
    def geometry(self) -> GridGeometry:
        """Where the grid lies, map frame."""
        return self.team.grid().geometry

    @property
    def log_odds(self) -> npt.NDArray[np.float32]:
        """The grid, (rows, cols) float32."""
        return self.team.grid().log_odds

    @property
    def lattice(self) -> tuple[int, int]:
        """Row and column of the grid's first cell on the lattice through (0, 0)."""
        geometry = self.geometry
        return (
            round(geometry.origin_y / geometry.resolution),
            round(geometry.origin_x / geometry.resolution),
        )

    def _lattice_box(self, box: CellBox) -> CellBox:
        return box if box.empty else box.shifted(*self.lattice)
