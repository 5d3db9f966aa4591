"""Seams: where two pieces of the map meet and nothing says well how they lie to each other.

Where a robot crosses a wide space with nothing in sight, only its wheels say how far it came and
turned. What it draws on the other side is well shaped but may hang askew, and if each part of a
wall has been seen from one side only, nothing ever tells. The pose graph knows it: the place of one
piece in the other has a large covariance. A scan that shows walls of both ties them.

What counts is how far the walls may stand off each other across. Along a bare wall two pieces of it
may slide, but no look from anywhere would tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mapping.geometry import Floats

# Pieces farther apart than this are not seen together from nearby [m].
_GAP = 4.0
# A turn counts like a shift at this distance [m]: walls run on from the seam.
_LEVER = 3.0
# A piece with fewer points on walls has none.
_LEAST = 10
# Walls that face more against each other than this (cosine) cannot be seen from one place.
_FACING = -0.3


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of the map.

    Attributes:
        anchor: (x, y) of what holds it, a place from where its walls were seen [m], map frame.
        walls: (n, 2) points on its walls [m], map frame.
        normals: (n, 2) unit vectors across these, map frame; of either sign.
    """

    anchor: Floats
    walls: Floats
    normals: Floats


@dataclass(frozen=True, slots=True)
class Seam:
    """Where two pieces meet.

    Attributes:
        sigma: one sigma of how far their walls may stand off each other [m].
        ends: (2, 2) where the one and the other end, (x, y) [m], map frame.
        outward: (2,) unit vector from the walls to where robots are, map frame.
    """

    sigma: float
    ends: Floats
    outward: Floats


def loose_seams(pieces: Sequence[Piece], joint: Floats, loose: float) -> list[Seam]:
    """Return the seams that are looser than allowed, the loosest first.

    Args:
        pieces: all pieces of the map.
        joint: (3 n, 3 n) covariance of the (x, y, theta) of all n anchors, map frame.
        loose: sigma up to which a seam is firm [m].
    """
    blocks = joint.reshape(len(pieces), 3, len(pieces), 3).transpose(0, 2, 1, 3)
    trees: dict[int, cKDTree] = {}
    seams = []
    for i, j in _doubtful(pieces, blocks, loose):
        for k in (i, j):
            if k not in trees:
                trees[k] = cKDTree(pieces[k].walls)
        seam = _seam(pieces[i], pieces[j], trees[j], blocks[np.ix_((i, j), (i, j))])
        if seam is not None and seam.sigma > loose:
            seams.append(seam)
    return sorted(seams, key=lambda seam: -seam.sigma)


def _doubtful(pieces: Sequence[Piece], blocks: Floats, loose: float) -> Iterator[tuple[int, int]]:
    """Return the pairs of pieces that may have a loose seam: a quick look, on the safe side."""
    anchors = np.array([piece.anchor for piece in pieces]).reshape(-1, 2)
    reaches = np.array([_reach(piece) for piece in pieces])
    own = np.array([blocks[k, k] for k in range(len(pieces))])
    for i in range(len(pieces)):
        # How j's anchor moves with i's, less how it moves by itself.
        away = anchors - anchors[i]
        moves = np.array([_moves(lever) for lever in away])
        mixed = moves @ blocks[i][:, :, :2]
        step = moves @ own[i] @ moves.transpose(0, 2, 1) + own[:, :2, :2]
        step = step - mixed - mixed.transpose(0, 2, 1)
        shift = np.sqrt(np.maximum(step[:, 0, 0] + step[:, 1, 1], 0.0))
        turn = own[i, 2, 2] + own[:, 2, 2] - 2.0 * blocks[i, :, 2, 2]
        most = shift + np.sqrt(np.maximum(turn, 0.0)) * (np.maximum(reaches, 0.0) + _LEVER)
        near = np.hypot(*away.T) <= reaches[i] + reaches + _GAP
        for j in np.flatnonzero(near & (most > loose)).tolist():
            if j > i:
                yield i, j


def _reach(piece: Piece) -> float:
    """Return how far a piece's walls reach [m]; minus infinity if it has too little of any."""
    if len(piece.walls) < _LEAST:
        return -math.inf
    return float(np.hypot(*(piece.walls - piece.anchor).T).max())


def _seam(one: Piece, other: Piece, tree: cKDTree, blocks: Floats) -> Seam | None:
    """Return where two pieces meet, or None if they cannot be seen together."""
    distances, at = (np.asarray(found) for found in tree.query(one.walls))
    k = int(np.argmin(distances))
    if distances[k] > _GAP:
        return None
    ends = np.array([one.walls[k], other.walls[at[k]]])
    faces = np.array(
        [
            _towards(one.normals[k], one.anchor - ends[0]),
            _towards(other.normals[at[k]], other.anchor - ends[1]),
        ]
    )
    if faces[0] @ faces[1] < _FACING:
        return None
    # How a point at the seam moves with the one piece, less how it moves with the other.
    middle = ends.mean(axis=0)
    moves = np.concatenate((_moves(middle - one.anchor), -_moves(middle - other.anchor)), axis=1)
    joint = blocks.transpose(0, 2, 1, 3).reshape(6, 6)
    step = moves @ joint @ moves.T
    turn = joint[2, 2] + joint[5, 5] - 2.0 * joint[2, 5]
    across = max(float(face @ step @ face) for face in faces)
    outward = faces.sum(axis=0)
    sigma = math.sqrt(max(across + _LEVER**2 * turn, 0.0))
    return Seam(sigma, ends, outward / np.hypot(*outward))


def _moves(lever: Floats) -> Floats:
    """Return how a point moves (2, 3) with the (x, y, theta) of what holds it from afar [m]."""
    return np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]]])


def _towards(normal: Floats, view: Floats) -> Floats:
    """Return a normal with the sign that makes it point to where its wall was seen from."""
    return normal if normal @ view >= 0.0 else -normal
