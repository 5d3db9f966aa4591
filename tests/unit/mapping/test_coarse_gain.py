import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mapping.coarse_gain import coarse_information_gains, coarsen_classes
from mapping.frontiers import find_frontiers
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN
from mapping.information_gain import information_gains

BESIDE = Path(__file__).resolve().parents[4] / "shared" / "data"
MAPS = Path(os.environ.get("EXPEDITION_DATA", BESIDE)) / "maps"


def rooms(rows: int, cols: int) -> np.ndarray:
    """A building of rooms of 40 x 40 cells with doors 16 wide in all walls between them."""
    classes = np.full((rows, cols), CLEAR, dtype=np.uint8)
    classes[::40, :] = classes[:, ::40] = OBSTACLE
    classes[-1, :] = classes[:, -1] = OBSTACLE
    for iy in range(20, rows, 40):
        classes[iy - 8 : iy + 8, 40 : cols - 40 : 40] = CLEAR
    for ix in range(20, cols, 40):
        classes[40 : rows - 40 : 40, ix - 8 : ix + 8] = CLEAR
    return classes


def revealed(truth: np.ndarray, centres: list[tuple[int, int]], radius: int) -> np.ndarray:
    iy, ix = np.indices(truth.shape)
    known = np.zeros(truth.shape, dtype=bool)
    for cy, cx in centres:
        known |= (iy - cy) ** 2 + (ix - cx) ** 2 <= radius**2
    return np.where(known, truth, UNKNOWN).astype(np.uint8)


def test_blocks() -> None:
    classes = np.full((5, 6), CLEAR, dtype=np.uint8)
    classes[0, 0] = OBSTACLE
    classes[1, 1] = UNKNOWN
    classes[0, 3] = UNKNOWN
    classes[4, 4:] = UNKNOWN
    coarse = coarsen_classes(classes, 2)
    assert coarse.classes.tolist() == [
        [OBSTACLE, UNKNOWN, CLEAR],
        [CLEAR, CLEAR, CLEAR],
        [CLEAR, CLEAR, UNKNOWN],
    ]
    assert coarse.weight.tolist() == [[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]
    weighted = coarsen_classes(classes, 2, np.full(classes.shape, 0.25, dtype=np.float32))
    np.testing.assert_array_equal(weighted.classes, coarse.classes)
    np.testing.assert_array_equal(weighted.weight, 0.25 * coarse.weight)


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 14), st.integers(1, 14)),
    reach=st.sampled_from([1.0, 3.0, 6.5, 30.0]),
    weighted=st.booleans(),
    seed=st.integers(0, 100_000),
)
def test_blocks_of_one_cell_change_nothing(
    shape: tuple[int, int], reach: float, weighted: bool, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, shape, p=[0.6, 0.3, 0.1]).astype(np.uint8)
    weight = rng.random(shape).astype(np.float32) if weighted else None
    cells = np.column_stack((rng.integers(0, shape[0], 3), rng.integers(0, shape[1], 3)))
    classes[cells[:, 0], cells[:, 1]] = CLEAR
    fine = information_gains(classes, weight, cells, reach)
    coarse = coarse_information_gains(coarsen_classes(classes, 1, weight), cells, reach)
    np.testing.assert_allclose(coarse[0], fine[0], rtol=1e-6)
    np.testing.assert_array_equal(coarse[1], fine[1])


@pytest.mark.parametrize(("factor", "share"), [(2, 0.9), (4, 0.75)])
def test_gains_come_out_alike(factor: int, share: float) -> None:
    classes = revealed(rooms(121, 161), [(20, 20), (60, 70), (25, 90)], 34)
    cells = find_frontiers(classes).cells
    fine, _ = information_gains(classes, None, cells, 60.0)
    coarse, _ = coarse_information_gains(coarsen_classes(classes, factor), cells, 60.0)
    large = fine > 200.0
    assert large.sum() > 10
    alike = np.abs(coarse[large] / fine[large] - 1.0) < 0.1
    assert alike.mean() >= share
    assert coarse.sum() == pytest.approx(fine.sum(), rel=0.1)


def test_the_flood_starts_on_the_right_side_of_a_wall() -> None:
    classes = np.zeros((40, 40), dtype=np.uint8)
    classes[18:22, :] = CLEAR
    classes[17, :] = OBSTACLE  # in the same blocks as the clear cells above it
    gains, boxes = coarse_information_gains(coarsen_classes(classes, 4), [(21, 20)], 15.0)
    assert boxes[0, 0] >= 18
    assert gains[0] == pytest.approx(
        information_gains(classes, None, [(21, 20)], 15.0)[0][0], rel=0.1
    )


def test_a_small_pocket_is_counted_exactly() -> None:
    classes = np.full((30, 30), CLEAR, dtype=np.uint8)
    classes[14:17, 13:15] = UNKNOWN
    classes[14, 18:30] = UNKNOWN  # in blocks that touch the pocket's
    for factor in (2, 4):
        gains, boxes = coarse_information_gains(coarsen_classes(classes, factor), [(15, 12)], 20.0)
        assert gains.tolist() == [6.0]
        assert boxes.tolist() == [[14, 13, 17, 15]]


def test_no_gain_and_a_way_out_only_through_obstacle_blocks() -> None:
    classes = np.full((24, 24), OBSTACLE, dtype=np.uint8)
    classes[1:5, 9] = CLEAR
    classes[5:23, 9] = UNKNOWN  # a slit: every block of it holds obstacles
    coarse = coarsen_classes(classes, 4)
    gains, boxes = coarse_information_gains(coarse, [(1, 9), (4, 9)], 15.0)
    assert gains.tolist() == [0.0, 15.0]
    assert boxes.tolist() == [[1, 9, 1, 9], [5, 9, 20, 10]]
    half = coarsen_classes(classes, 4, np.full(classes.shape, 0.5, dtype=np.float32))
    assert coarse_information_gains(half, [(4, 9)], 15.0)[0].tolist() == [7.5]


def test_a_short_range_stays_fine() -> None:
    classes = np.zeros((20, 20), dtype=np.uint8)
    classes[10, 10] = CLEAR
    coarse = coarsen_classes(classes, 4)
    for reach in (3.0, 8.0):
        expected = information_gains(classes, None, [(10, 10)], reach)
        np.testing.assert_array_equal(
            coarse_information_gains(coarse, [(10, 10)], reach)[0], expected[0]
        )


@pytest.mark.data
@pytest.mark.skipif(not MAPS.is_dir(), reason="the real maps are not here")
@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="whole maps take plain Python too long"
)
@pytest.mark.parametrize("name", ["hospital_62m", "office_furnished", "lab_scanned", "gdc_3"])
@pytest.mark.parametrize("factor", [2, 4])
def test_gains_come_out_alike_on_real_maps(name: str, factor: int) -> None:
    grey = np.asarray(Image.open(MAPS / f"{name}.png").convert("L"))
    truth = np.full(grey.shape, UNKNOWN, dtype=np.uint8)
    truth[grey > 205] = CLEAR
    truth[grey < 89] = OBSTACLE
    free = np.argwhere(truth == CLEAR)
    centres = [(int(iy), int(ix)) for iy, ix in free[:: len(free) // 14]]
    classes = revealed(truth, centres, 90)
    cells = find_frontiers(classes, spacing_cells=12).cells[::3]
    fine, _ = information_gains(classes, None, cells, 160.0)
    coarse, _ = coarse_information_gains(coarsen_classes(classes, factor), cells, 160.0)
    large = fine > 1000.0
    assert large.sum() > 50
    assert (np.abs(coarse[large] / fine[large] - 1.0) < 0.1).mean() >= 0.95
    assert coarse.sum() == pytest.approx(fine.sum(), rel=0.02)
