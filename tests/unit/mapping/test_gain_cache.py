import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import CellBox
from mapping.coarse_gain import coarse_grounds, coarse_information_gains, coarsen_classes
from mapping.gain_cache import GainCache
from mapping.geometry import Floats
from mapping.grid import CLEAR, Cells
from mapping.visible_gain import Sight, visible_gains


class Estimates:
    """Both ways to work out gains, on classes that may change from call to call."""

    def __init__(self, classes: np.ndarray, factor: int, reach: float) -> None:
        self.classes, self.factor, self.reach = classes, factor, reach

    def flood(self, cells: Cells) -> tuple[Floats, Cells, Cells]:
        coarse = coarsen_classes(self.classes, self.factor)
        gains, boxes = coarse_information_gains(coarse, cells, self.reach)
        return gains, boxes, coarse_grounds(cells, boxes, self.factor)

    def sight(self, cells: Cells) -> tuple[Floats, Cells, Cells]:
        gains, depends = visible_gains(self.classes, None, cells, Sight(self.reach, 6.0, 24))
        return gains, depends, depends


@settings(max_examples=40, deadline=None)
@given(
    factor=st.sampled_from([1, 2, 4]),
    reach=st.sampled_from([2.0, 5.0, 40.0]),
    known=st.sampled_from([0.1, 0.5]),
    seed=st.integers(0, 100_000),
    by=st.sampled_from(["flood", "sight"]),
)
def test_equals_a_fresh_computation(
    factor: int, reach: float, known: float, seed: int, by: str
) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, (22, 19), p=[1 - known, known / 2, known / 2]).astype(np.uint8)
    estimate = getattr(Estimates(classes, factor, reach), by)
    cache = GainCache(estimate)
    for _ in range(4):
        changed = []
        for _ in range(2):
            iy, ix = int(rng.integers(0, 20)), int(rng.integers(0, 17))
            box = CellBox(iy, ix, iy + int(rng.integers(0, 3)), ix + int(rng.integers(0, 3)))
            classes[box.slices] = rng.integers(0, 3, classes[box.slices].shape)
            changed.append(box)
        cells = np.argwhere(classes == CLEAR)[:: int(rng.integers(3, 9))]
        gains, boxes = cache.gains(cells, changed)
        fresh_gains, fresh_boxes, _ = estimate(cells)
        np.testing.assert_array_equal(gains, fresh_gains)
        np.testing.assert_array_equal(boxes, fresh_boxes)


def test_only_what_changed_is_worked_out_again() -> None:
    classes = np.zeros((20, 60), dtype=np.uint8)
    classes[:, 28:32] = CLEAR
    cells = [(10, 28), (10, 31)]
    cache = GainCache(Estimates(classes, 2, 20.0).flood)
    first, _ = cache.gains(cells, [])
    assert cache.evaluated == 2
    cache.gains(cells, [CellBox(10, 56, 12, 58)])
    assert cache.evaluated == 0
    classes[10:12, 44:46] = CLEAR
    second, _ = cache.gains(cells, [CellBox(10, 44, 12, 46)])
    assert cache.evaluated == 1
    assert second[0] == first[0]
    assert second[1] < first[1]
    cache.forget()
    cache.gains(cells, [])
    assert cache.evaluated == 2
