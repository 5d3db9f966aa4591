import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.cell_box import EMPTY_BOX, CellBox
from mapping.frontiers import find_frontiers
from mapping.grid import CLEAR, OBSTACLE, UNKNOWN


def frontier_mask(classes: np.ndarray) -> np.ndarray:
    unknown = np.pad(classes == UNKNOWN, 1)
    beside = unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
    mask: np.ndarray = (classes == CLEAR) & beside
    return mask


def components(mask: np.ndarray) -> list[set[tuple[int, int]]]:
    left = {(int(iy), int(ix)) for iy, ix in np.argwhere(mask)}
    found = []
    for seed in sorted(left):
        if seed not in left:
            continue
        left.remove(seed)
        group, queue = {seed}, [seed]
        while queue:
            cy, cx = queue.pop()
            for other in [(cy + dy, cx + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]:
                if other in left:
                    left.remove(other)
                    group.add(other)
                    queue.append(other)
        found.append(group)
    return found


@settings(max_examples=80, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 16), st.integers(1, 16)),
    spacing=st.integers(1, 5),
    min_cells=st.integers(1, 4),
    seed=st.integers(0, 100_000),
)
def test_representatives_of_every_component(
    shape: tuple[int, int], spacing: int, min_cells: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    classes = rng.choice([UNKNOWN, CLEAR, OBSTACLE], shape, p=[0.2, 0.6, 0.2]).astype(np.uint8)
    frontiers = find_frontiers(classes, spacing, min_cells)
    expected = [g for g in components(frontier_mask(classes)) if len(g) >= min_cells]
    assert sorted(set(frontiers.component.tolist())) == list(range(len(expected)))
    assert len(frontiers) == len(frontiers.component) == len(frontiers.component_size)
    for k, group in enumerate(expected):
        own = frontiers.component == k
        assert set(frontiers.component_size[own].tolist()) == {len(group)}
        chosen = [(int(iy), int(ix)) for iy, ix in frontiers.cells[own]]
        assert set(chosen) <= group
        mean = np.mean(sorted(group), axis=0)
        away = {cell: float(((cell - mean) ** 2).sum()) for cell in group}
        assert away[chosen[0]] <= min(away.values()) + 1e-9
        squared = {c: [(c[0] - a[0]) ** 2 + (c[1] - a[1]) ** 2 for a in chosen] for c in group}
        assert all(min(d) < spacing**2 for d in squared.values())  # nobody is left out
        for cell in chosen:
            assert sorted(squared[cell])[1:2] == [] or sorted(squared[cell])[1] >= spacing**2


def test_a_straight_frontier() -> None:
    classes = np.full((10, 30), CLEAR, dtype=np.uint8)
    classes[6:] = UNKNOWN
    frontiers = find_frontiers(classes, spacing_cells=6)
    assert frontiers.cells[0].tolist() == [5, 14]
    assert (frontiers.cells[:, 0] == 5).all()
    assert sorted(frontiers.cells[:, 1].tolist()) == [2, 8, 14, 20, 26]
    assert frontiers.component_size.tolist() == [30] * 5


def test_noise_is_dropped_and_corners_do_not_touch() -> None:
    classes = np.full((9, 9), CLEAR, dtype=np.uint8)
    classes[4, 4] = UNKNOWN
    assert len(find_frontiers(classes, min_cells=5)) == 0
    assert len(find_frontiers(classes, spacing_cells=9, min_cells=4)) == 1
    across = np.array([[CLEAR, OBSTACLE], [OBSTACLE, UNKNOWN]], dtype=np.uint8)
    assert len(find_frontiers(across, min_cells=1)) == 0


def test_outside_the_grid_is_not_unknown() -> None:
    assert len(find_frontiers(np.full((5, 5), CLEAR, dtype=np.uint8), min_cells=1)) == 0


def test_frontiers_at_the_edges_of_the_grid() -> None:
    for turn in range(4):
        classes = np.full((6, 6), CLEAR, dtype=np.uint8)
        classes[:, 1] = UNKNOWN
        turned = np.rot90(classes, turn)
        expected = {(int(iy), int(ix)) for iy, ix in np.argwhere(frontier_mask(turned))}
        found = find_frontiers(turned, spacing_cells=1, min_cells=1)
        assert {(int(iy), int(ix)) for iy, ix in found.cells} == expected


def test_a_box_limits_the_search() -> None:
    classes = np.full((10, 30), CLEAR, dtype=np.uint8)
    classes[6:] = UNKNOWN
    within = find_frontiers(classes, 1, 1, CellBox(2, 10, 40, 14))
    assert sorted(within.cells.tolist()) == [[5, 10], [5, 11], [5, 12], [5, 13]]
    assert len(find_frontiers(classes, 1, 1, CellBox(0, 0, 5, 30))) == 0
    assert len(find_frontiers(classes, 1, 1, EMPTY_BOX)) == 0
