"""How many bytes the updates of a map take, sent as cells of a grid or as scans with poses.

Two things the paper leaves open are decided here.

When does a cell change? The paper speaks of "a list of changed grid cells with their new values",
4-byte floats, and says of a map that is well known: "a complete scan is integrated in the map, it
only contributes new information to this one cell". So values saturate, but how soon? Its table
tells what share of the cells in the bounding boxes changed, (CellList / 12) / (BoundingBox / 4):
12, 28 and 19 % in its three sets. What comes nearest, still below it, is the value that our own
grids have, clamped log-odds: 7 % in the simulated office, 4 % in a log of a real one. A cell that
is seen the same way again and again changes seven times, then never. It counts by default
(`"log_odds"`). If the value is the share of scans that hit a cell (`"share"`), so that free stays
free at once and only cells beside walls go on changing, it is 3 % in both, and grids take 2.4 times
less in the simulated office and 1.15 times less in the real one. If a cell changes only when it
turns from unknown, free or occupied into another of these (`"known"`), it is 1 to 2 %, and grids
take six times less, so little that scans with poses take more. What the comparison says hangs on
this choice: tell it with the result. It hangs on how often scans are told, too: the nearer they are
to each other, the less each one changes.

(`"log_odds"` clamps the sum of all that scans said, where `mapping.grid` clamps after each scan:
then a single scan that contradicts a sure cell would change it. So fewer cells change here.)

What becomes of a scan that changes nothing? "It is important that it does add new information at
least to one cell, otherwise the scan would be discarded completely": it is sent by no method and is
not among the earlier scans whose poses are told. New poses of earlier scans are sent all the same.

Source: Pfingsthorn et al. 2007, section 3.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from expedition.experiments.drawn_map import DrawnMap, MapChange
from expedition.experiments.map_updates import MapUpdate
from expedition.experiments.vote_counts import CellValue

NUMBER = 4  # bytes of a float or an int
METHODS = ("cell_list", "bounding_box", "best_grid", "pose_graph")


def cell_list_bytes(changed: int) -> int:
    """Return the size of a list of changed cells.

    "Transmits (x_c, y_c, v_c)^{N_c} which requires 3 * N_c * 4 bytes."
    """
    return 3 * changed * NUMBER


def bounding_box_bytes(cells: int) -> int:
    """Return the size of all cells in the box around what changed; 0 without any.

    "Transmits (x_1, y_1, x_2, y_2, v_c^{(x_2-x_1)(y_2-y_1)}) which requires (4 + N_b) * 4 bytes."
    """
    return (4 + cells) * NUMBER if cells else 0


def best_grid_bytes(changed: int, cells: int) -> int:
    """Return the smaller of both: "BestGrid(N_c, N_b) = min(CellList(N_c), BoundingBox(N_b))"."""
    return min(cell_list_bytes(changed), bounding_box_bytes(cells))


def pose_graph_bytes(beams: int, earlier: int) -> int:
    """Return the size of a scan with its pose, and of the poses of earlier scans.

    "(3 + 181) * 4 = 736 or (3 + 361) * 4 = 1456 bytes. In case the poses of previous observations
    are included, the message requires (3 + 361 + 3 * N_s) * 4 bytes."

    Args:
        beams: of the scan; 0 if there is none, and the update holds poses only.
        earlier: N_s, how many earlier scans' poses are included.
    """
    return ((3 + beams if beams else 0) + 3 * earlier) * NUMBER


@dataclass(frozen=True, slots=True)
class UpdateSizes:
    """The sizes of all updates that were sent, in their order.

    Attributes:
        stamps: (n,) [s].
        sizes: method of `METHODS` -> (n,) int64 [bytes].
        observations: how many scans were sent.
        discarded: how many scans changed no cell and were not sent.
        changed: how many cells changed, all updates together.
        boxed: how many cells their bounding boxes held.
    """

    stamps: npt.NDArray[np.float64]
    sizes: dict[str, npt.NDArray[np.int64]]
    observations: int
    discarded: int
    changed: int
    boxed: int

    @property
    def totals(self) -> dict[str, int]:
        """Bytes by method, all updates together."""
        return {method: int(sizes.sum()) for method, sizes in self.sizes.items()}


def update_sizes(
    updates: Iterable[MapUpdate], resolution: float = 0.1, value: CellValue = "log_odds"
) -> UpdateSizes:
    """Return what a sequence of updates takes by each method.

    Args:
        updates: in their order; the poses of earlier scans go by the numbers they give.
        resolution: edge of a cell of the grid [m].
        value: when a cell counts as changed, see above.

    Raises:
        IndexError: an update moves a scan that has not come yet.
    """
    drawn = DrawnMap(resolution, value)
    changes = [(update.stamp, drawn.take(update)) for update in updates]
    sent = [(stamp, change) for stamp, change in changes if change.beams or change.earlier]
    table = np.array([_sizes_of(change) for _, change in sent], dtype=np.int64).reshape(-1, 4)
    return UpdateSizes(
        np.array([stamp for stamp, _ in sent], dtype=np.float64),
        {method: table[:, i] for i, method in enumerate(METHODS)},
        sum(change.beams > 0 for _, change in sent),
        sum(change.discarded for _, change in changes),
        sum(change.cells for _, change in sent),
        sum(change.boxed for _, change in sent),
    )


def _sizes_of(change: MapChange) -> tuple[int, int, int, int]:
    """Return the sizes [bytes] of one update in the order of `METHODS`."""
    return (
        cell_list_bytes(change.cells),
        bounding_box_bytes(change.boxed),
        best_grid_bytes(change.cells, change.boxed),
        pose_graph_bytes(change.beams, change.earlier),
    )
