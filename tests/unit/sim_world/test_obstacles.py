import numpy as np
import pytest

from sim_world.errors import WorldError
from sim_world.floor_plan import FloorPlan, RandomObstacles, solids_of
from sim_world.obstacles import place_obstacles
from sim_world.scene import WallScene
from sim_world.truth import body_places, reachable_places
from sim_world.walls import build_walls

STARTS = np.array([[1.0, 4.0]])


def _hall(size=8.0, **keys):
    plan = FloorPlan(name="hall", description="", size_m=(size, size), **keys)
    return solids_of(plan)


def _place(spec, seed=0, starts=STARTS, hall=None):
    solids, bare = hall or _hall()
    obstacles = place_obstacles(spec, solids, bare, starts, np.random.default_rng(seed))
    return obstacles, WallScene(build_walls([*solids, *obstacles], bare))


@pytest.mark.parametrize("shape", ["box", "turned_box", "disc"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_density_is_met_and_the_floor_stays_connected(shape, seed):
    spec = RandomObstacles(density=0.2, size_m=(0.4, 1.2), shape=shape)
    _, scene = _place(spec, seed)
    solid, geometry = scene.free_truth()
    inner = geometry.box_around(0.1, 0.1, 7.9, 7.9)
    assert 0.18 < np.count_nonzero(solid[inner.slices]) / solid[inner.slices].size < 0.27
    places = body_places(solid, geometry, 0.25)
    assert (reachable_places(places, geometry, STARTS) == places).all()
    assert scene.clearance(1.0, 4.0, 2.0) >= 0.9


def test_same_seed_same_world():
    spec = RandomObstacles(density=0.1)
    one, same, other = (_place(spec, seed)[0] for seed in (4, 4, 5))
    assert all((a == b).all() for a, b in zip(one, same, strict=True))
    assert len(one) != len(other) or any((a != b).any() for a, b in zip(one, other, strict=True))


def test_passages_are_wide_or_none():
    spec = RandomObstacles(density=0.1, size_m=(0.4, 0.8), passage_m=0.9)
    obstacles, _ = _place(spec, 3)
    boxes = [(*c.min(axis=0), *c.max(axis=0)) for c in obstacles]
    for i, (ax1, ay1, ax2, ay2) in enumerate(boxes):
        for bx1, by1, bx2, by2 in boxes[:i]:
            gap = np.hypot(max(bx1 - ax2, ax1 - bx2, 0), max(by1 - ay2, ay1 - by2, 0))
            assert gap < 0.11 or gap > 0.78


def test_a_region_keeps_obstacles_inside():
    spec = RandomObstacles(density=0.15, region=(4.0, 1.0, 7.0, 7.0))
    obstacles, _ = _place(spec, 1, starts=np.empty((0, 2)))
    corners = np.vstack(obstacles)
    assert (corners.min(axis=0) >= [4.0, 1.0]).all() and (corners.max(axis=0) <= [7.0, 7.0]).all()


def test_walls_without_thickness():
    spec = RandomObstacles(density=0.05, size_m=(0.4, 0.8))
    obstacles, _ = _place(spec, hall=_hall(4.0, wall_thickness_m=0.0))
    assert obstacles


@pytest.mark.parametrize(
    "keys", [{"density": 0.6, "passage_m": 3.0}, {"density": 0.1, "region": (20, 20, 30, 30)}]
)
def test_what_cannot_be_reached_is_refused(keys):
    with pytest.raises(WorldError, match="out of reach"):
        _place(RandomObstacles(size_m=(0.5, 1.0), **keys), hall=_hall(4.0))
