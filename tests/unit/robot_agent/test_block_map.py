from __future__ import annotations

import numpy as np
import pytest

from mapping.cell_box import CellBox
from mapping.coarse_gain import coarsen_classes
from mapping.coarse_weights import coarsen_weights
from mapping.information_gain import entropy_weight, roomy_classes
from protocol.map_cells import dequantise, pack_cells
from protocol.messages import MapDelta
from robot_agent.block_map import BlockMap, joined
from robot_agent.navigation_settings import PlanningMapSettings
from robot_agent.planning_map import PlanningMap

RESOLUTION = 0.1


def delta(number: int, at: tuple[int, int], log_odds: np.ndarray) -> MapDelta:
    return MapDelta(
        number=number,
        resolution_m=RESOLUTION,
        lattice_x=at[1],
        lattice_y=at[0],
        rows=log_odds.shape[0],
        cols=log_odds.shape[1],
        cells=pack_cells(log_odds.astype(np.float32)),
    )


@pytest.mark.parametrize("by_probability", [True, False])
def test_blocks_follow_the_map_wherever_it_changes(by_probability: bool) -> None:
    rng = np.random.default_rng(4)
    planning_map = PlanningMap(0.2, PlanningMapSettings(resolution_m=RESOLUTION))
    blocks = BlockMap(planning_map, 4, 2, by_probability)
    for number in range(1, 12):
        at = (int(rng.integers(-30, 60)), int(rng.integers(-30, 60)))
        shape = (int(rng.integers(1, 40)), int(rng.integers(1, 40)))
        log_odds = rng.choice([-3.0, -3.0, -3.0, 0.0, 3.0], shape)
        assert planning_map.apply_delta(delta(number, at, log_odds)) is not None
        blocks.changed(planning_map.take_changes() or [])
        if number % 3 == 0:
            continue  # several changes at once
        blocks.refresh()
        counts = entropy_weight(dequantise(planning_map.cells)) if by_probability else None
        roomy = roomy_classes(
            planning_map.classes, planning_map.clearance, planning_map.clearance_least
        )
        anew = coarsen_classes(roomy, 4, counts)
        np.testing.assert_array_equal(blocks.gains.fine, roomy)
        np.testing.assert_array_equal(blocks.gains.classes, anew.classes)
        np.testing.assert_array_equal(blocks.gains.weight, anew.weight)
        np.testing.assert_array_equal(blocks.gains.fine_weight, anew.fine_weight)
        np.testing.assert_array_equal(blocks.weights, coarsen_weights(planning_map.weights, 2))


def test_boxes_that_overlap_are_joined_until_none_do() -> None:
    left, right, bridge = CellBox(0, 0, 2, 2), CellBox(0, 4, 2, 6), CellBox(1, 1, 2, 5)
    far = CellBox(8, 8, 9, 9)
    assert joined([left, right]) == [left, right]
    assert joined([left, right, far, bridge]) == [far, CellBox(0, 0, 2, 6)]
    assert joined([]) == []
