import math

import numpy as np
import pytest
from PIL import Image

from mapping.geometry import Pose2
from sim_world.errors import WorldError
from sim_world.scene import GridScene, WallScene
from sim_world.starts import check_starts
from sim_world.truth import body_places, reachable_area, reachable_places
from sim_world.victims import Victim
from sim_world.world_file import WORLDS, load_world, read_plan, shipped_worlds, start_poses

DRAWING = """
name = "tiny"
description = "one room"
size_m = [5.0, 4.0]
starts = [[1.0, 2.0, 90.0]]
"""
NAMES = sorted(path.stem for path in WORLDS.glob("*.toml"))


def test_shipped_worlds_are_listed_by_the_names_that_load_them():
    worlds = shipped_worlds()
    assert sorted(worlds) == NAMES
    assert {"hospital", "office_single_corridor", "obstacle_free", "random_30"} <= set(worlds)
    assert all("\n" not in text and text for text in worlds.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_place_of_a_shipped_world_can_be_reached(name):
    world = load_world(name, 7)
    poses = start_poses(world, 6)
    check_starts(world.scene, poses)
    assert len(world.starts) >= 3
    solid, geometry = world.scene.free_truth()
    places = body_places(solid, geometry, 0.25)
    starts = [(pose.x, pose.y) for pose in world.starts]
    assert (reachable_places(places, geometry, starts) == places).all()
    reachable = reachable_area(solid, geometry, starts, 0.25)
    for x1, y1, x2, y2 in read_plan(WORLDS / f"{name}.toml").rooms:
        room = geometry.box_around(x1, y1, x2, y2).slices
        assert np.count_nonzero(reachable[room]) > 0.9 * np.count_nonzero(~solid[room])


def test_sizes_are_those_of_the_paper():
    sizes = {name: read_plan(WORLDS / f"{name}.toml").size_m for name in NAMES}
    assert sizes["hospital"] == (62.0, 43.0)
    assert sizes["office_single_corridor"] == sizes["office_parallel_corridors"] == (25.0, 20.0)
    assert sizes["obstacle_free"] == sizes["random_15"] == sizes["random_30"] == (20.0, 20.0)


def test_a_drawing(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(DRAWING)
    world = load_world(path, 0)
    assert (world.name, world.description) == ("tiny", "one room")
    assert world.starts == (Pose2(1.0, 2.0, math.pi / 2),)
    assert isinstance(world.scene, WallScene)
    assert start_poses(world, 1) == [Pose2(1.0, 2.0, math.pi / 2)]


def test_victims_lie_where_the_drawing_says(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(DRAWING + "victims = [{ id = 'v1', x = 2.5, y = 3 }]\n")
    assert load_world(path, 0).victims == (Victim(id="v1", x=2.5, y=3.0),)
    assert [victim.id for victim in load_world("hospital", 1).victims] == ["v1", "v2", "v3", "v4"]


def test_the_seed_decides_the_obstacles(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(DRAWING + "[[obstacles]]\ndensity = 0.05\nsize_m = [0.3, 0.5]\n")
    one, same, other = (load_world(path, seed).scene.walls.segments for seed in (1, 1, 2))
    assert (one == same).all()
    assert one.shape != other.shape or (one != other).any()


def test_a_map(tmp_path):
    pixels = np.full((30, 40), 254, dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text("image: m.png\nresolution: 0.1\norigin: [0, 0, 0]\n")
    world = load_world(tmp_path / "m.yaml", 0)
    assert isinstance(world.scene, GridScene)
    assert world.starts == ()
    assert len(start_poses(world, 2)) == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = ", "cannot be read as TOML"),
        (DRAWING + "wals = []", "unknown key 'wals'"),
        (DRAWING.replace('name = "tiny"', ""), "'name' is missing; add it"),
        (DRAWING + "rooms = [[0, 0, 1]]", r"'rooms\[0\]\[3\]' is missing"),
        (DRAWING + "pillars = [[1, 1, -1]]", r"'pillars\[0\]\[2\]' is -1: input should be greater"),
        (DRAWING + "doors = [[2, 2, 1]]", r"doors\[0\] at \(2, 2\) lies on no wall"),
        (DRAWING + "boxes = [[0.9, 1.9, 1.4, 2.4]]", r"robot 1 cannot start at \(1.00, 2.00\)"),
        (DRAWING + "[[obstacles]]\ndensity = 2.0", r"'obstacles\[0\].density' is 2.0"),
        (
            DRAWING + "victims = [{id = 'v', x = 9, y = 1}]",
            r"'v' cannot lie at \(9, 1\): that is out",
        ),
        (
            DRAWING + "victims = [{id = 'v', x = 5, y = 1}]",
            "'v' cannot lie.*solid is there; move it",
        ),
        (DRAWING + "victims = [{x = 1, y = 1}]", r"'victims\[0\].id' is missing"),
    ],
)
def test_bad_drawings_are_named_in_one_line(tmp_path, text, says):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(WorldError, match=says) as caught:
        load_world(path, 0)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("bad.toml: ")


@pytest.mark.parametrize("name", ["nowhere", "../worlds/hospital", "hospital.png"])
def test_unknown_names_list_the_known_ones(name):
    with pytest.raises(WorldError, match=f"no world '{name}'; use one of hospital, obstacle_free"):
        load_world(name, 0)


@pytest.mark.parametrize("name", ["none.toml", "none.yaml"])
def test_missing_files(name):
    with pytest.raises(WorldError, match=f"no world file {name}; check the path"):
        load_world(name, 0)


@pytest.mark.data
def test_a_real_map(data_dir):
    world = load_world(data_dir / "maps" / "lab_scanned.yaml", 0)
    check_starts(world.scene, [Pose2(4.82, y, 0.0) for y in (18.08, 18.88, 17.27)])
    check_starts(world.scene, start_poses(world, 5))
