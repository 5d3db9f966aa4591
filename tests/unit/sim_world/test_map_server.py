import numpy as np
import pytest
from PIL import Image

from sim_world.errors import WorldError
from sim_world.map_server import read_map

# White is free, black occupied, grey unknown; the first row is on top.
PIXELS = np.array([[254, 0, 205], [254, 254, 254]], dtype=np.uint8)
YAML = "image: map.png\nresolution: 0.5\norigin: [1.0, -2.0, 0.0]\n"


@pytest.fixture
def write(tmp_path):
    def _write(text=YAML, pixels=PIXELS, mode=None, name="map.png"):
        image = Image.fromarray(pixels)
        (image.convert(mode) if mode else image).save(tmp_path / name)
        path = tmp_path / "map.yaml"
        path.write_text(text)
        return path

    return _write


def test_what_is_not_free_is_solid(write):
    solid, geometry = read_map(write())
    assert solid.tolist() == [[False, False, False], [False, True, True]]
    assert (geometry.resolution, geometry.origin_x, geometry.origin_y) == (0.5, 1.0, -2.0)
    assert geometry.shape == (2, 3)


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "LA"])
def test_other_kinds_of_images(write, mode):
    solid, _ = read_map(write(mode=mode))
    assert solid.tolist() == [[False, False, False], [False, True, True]]


def test_bitmaps(write):
    solid, _ = read_map(write(mode="1"))
    assert solid[1, 1] and not solid[0, 0]


def test_negate_and_thresholds(write):
    solid, _ = read_map(write(YAML + "negate: 1\n"))
    assert solid.tolist() == [[True, True, True], [True, False, True]]
    grey_free, _ = read_map(
        write(YAML + "free_thresh: 0.25\noccupied_thresh: 0.65\nmode: trinary\n")
    )
    assert grey_free.tolist() == [[False, False, False], [False, True, False]]


def test_deep_images(write):
    deep = (PIXELS.astype(np.uint16)) * 257
    solid, _ = read_map(write(pixels=deep))
    assert solid.tolist() == [[False, False, False], [False, True, True]]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("image: [", "cannot be read as YAML"),
        ("just words", "holds no map; it needs image, resolution and origin"),
        ("image: map.png\norigin: [0, 0, 0]\n", "'resolution' is missing"),
        (YAML.replace("0.5", "-0.5"), "'resolution' is -0.5"),
        (YAML.replace("0.0]", "0.5]"), "origin has a yaw of 0.5 rad"),
        (YAML.replace("1.0", ".nan"), r"'origin\[0\]' is nan"),
        (YAML.replace("map.png", "none.png"), "does not exist; correct the key 'image'"),
        (YAML.replace("map.png", "map.yaml"), "cannot be read; save it as PNG or PGM"),
        (YAML + "mode: raw\n", "'mode' is 'raw'"),
    ],
)
def test_bad_files_are_named_in_one_line(write, text, says):
    with pytest.raises(WorldError, match=says) as caught:
        read_map(write(text))
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("map.yaml: ")


def test_a_huge_image_is_refused(write, monkeypatch):
    monkeypatch.setattr("sim_world.map_server._CELLS_MAX", 5)
    with pytest.raises(WorldError, match="too large"):
        read_map(write())


def test_a_missing_file(tmp_path):
    with pytest.raises(WorldError, match="cannot be read as YAML"):
        read_map(tmp_path / "none.yaml")


@pytest.mark.data
def test_real_maps(data_dir):
    solid, geometry = read_map(data_dir / "maps" / "willow.yaml")
    assert solid.shape == geometry.shape == (945, 1141)
    assert not solid[geometry.cell_at(9.18, 11.68)]
