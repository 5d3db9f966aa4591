from __future__ import annotations

from pathlib import Path

from mapping import compiled


def test_machine_code_is_keyed_by_all_that_it_may_depend_on():
    root = Path(compiled.__file__).parent.parent
    names = [path.name for path in compiled._sources_of(root / "mapping" / "surface_map.py")]
    assert {"surface_map.py", "closest_walls.py", "grid.py", "geometry.py"} <= set(names)
    assert names == sorted(names)
    assert "path_planning.py" not in names


def test_each_file_has_a_cache_folder_of_its_own():
    root = Path(compiled.__file__).parent
    folders = {compiled._cache_directory(root / name) for name in ("grid.py", "geometry.py")}
    assert len(folders) == 2
    assert all(folder.name.split("-")[0] in ("grid", "geometry") for folder in folders)


def test_a_file_that_is_not_there_depends_on_nothing(tmp_path):
    assert compiled._sources_of(tmp_path / "nothing.py") == ()
