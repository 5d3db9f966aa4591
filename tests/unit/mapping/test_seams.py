"""Pieces of one bare wall along x, seen from above: how loosely they hang together."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry import Floats
from mapping.seams import Piece, loose_seams

LOOSE = 0.1


def piece(first: float, last: float, y: float = 0.0, seen_from: float = 3.0) -> Piece:
    """A wall from x = `first` to `last` at `y`, held by an anchor `seen_from` above it."""
    x = np.arange(first, last, 0.05)
    walls = np.stack((x, np.full(len(x), y)), axis=1)
    normals = np.tile((0.0, -1.0), (len(x), 1))
    return Piece(np.array([0.5 * (first + last), y + seen_from]), walls, normals)


def joint(*of_second: float) -> Floats:
    """The first piece is known exactly, the second to these (x, y, theta), one sigma."""
    return np.diag([0.0, 0.0, 0.0, *(sigma**2 for sigma in of_second)])


LEFT, RIGHT = piece(0.0, 5.0), piece(6.0, 11.0)


def test_two_parts_of_a_wall_that_may_stand_off_each_other_have_a_loose_seam() -> None:
    (seam,) = loose_seams([LEFT, RIGHT], joint(0.0, 0.2, 0.0), LOOSE)
    assert seam.sigma == pytest.approx(0.2)
    assert seam.ends == pytest.approx(np.array([[4.95, 0.0], [6.0, 0.0]]))
    assert seam.outward == pytest.approx(np.array([0.0, 1.0]))


def test_a_piece_that_may_be_turned_is_loose_too() -> None:
    (seam,) = loose_seams([LEFT, RIGHT], joint(0.0, 0.0, math.radians(3.0)), LOOSE)
    assert seam.sigma > math.radians(3.0) * 3.0


def test_along_a_bare_wall_pieces_may_slide() -> None:
    assert loose_seams([LEFT, RIGHT], joint(0.5, 0.0, 0.0), LOOSE) == []


def test_what_moves_together_is_firm() -> None:
    both = np.zeros((6, 6))
    both[np.ix_([1, 4], [1, 4])] = 1.0
    assert loose_seams([LEFT, RIGHT], both, LOOSE) == []
    turned = np.concatenate((np.eye(3), np.eye(3)))
    turned[4, 2] = RIGHT.anchor[0] - LEFT.anchor[0]  # about the first anchor, both as one
    assert loose_seams([LEFT, RIGHT], turned @ turned.T, LOOSE) == []


@pytest.mark.parametrize(
    "other",
    [
        piece(6.0, 11.0, seen_from=-3.0),  # the other face of the wall
        piece(10.0, 15.0),  # too far off to be seen together
        piece(6.0, 6.2),  # hardly anything
    ],
)
def test_what_cannot_be_seen_together_has_no_seam(other: Piece) -> None:
    assert loose_seams([LEFT, other], joint(0.0, 0.2, 0.0), LOOSE) == []


def test_the_loosest_comes_first() -> None:
    pieces = [LEFT, piece(6.0, 11.0), piece(-6.0, -1.0)]
    known = np.diag([0.0, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.09, 0.0])
    first, second = loose_seams(pieces, known, LOOSE)
    assert (first.sigma, second.sigma) == pytest.approx((0.3, 0.2))
    assert loose_seams([], np.zeros((0, 0)), LOOSE) == []
