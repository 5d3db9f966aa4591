from pathlib import Path

import numpy as np
import pytest

from expedition.results.record import RunRecord, load_record, no_rows, save_record, save_record_part
from mapping.grid import GridGeometry, OccupancyGrid
from tests.unit.expedition.records import full_record, nasty_records


def test_round_trip(tmp_path: Path) -> None:
    record = full_record()
    save_record(tmp_path / "parts", record)
    back = load_record(tmp_path / "parts")
    assert back.problems == []
    assert [robot.id for robot in back.robots] == ["ada", "bob"]
    ada, was = back.robots[0], record.robots[1]
    np.testing.assert_array_equal(ada.track_map, was.track_map)
    np.testing.assert_array_equal(ada.track_world, was.track_world)
    assert (ada.scans, ada.path_m, ada.events) == (was.scans, was.path_m, was.events)
    assert back.grid is not None and record.grid is not None
    assert back.grid.geometry == record.grid.geometry
    assert back.grid.log_odds.dtype == np.float32
    np.testing.assert_array_equal(back.grid.log_odds, record.grid.log_odds)
    assert back.truth is not None and record.truth is not None
    assert back.truth.solid.dtype == np.bool_
    assert sorted(back.truth.starts) == ["ada", "bob"]
    assert back.tasks == record.tasks
    for name in ("ends", "measured", "information"):
        np.testing.assert_array_equal(
            getattr(back.pose_graph, name), getattr(record.pose_graph, name)
        )
    np.testing.assert_array_equal(back.pose_graph.chains["bob"], record.pose_graph.chains["bob"])
    assert back.bytes == record.bytes
    assert back.config["world"]["name"] == "room"


@pytest.mark.parametrize("name", nasty_records())
def test_every_record_can_be_saved_and_loaded(tmp_path: Path, name: str) -> None:
    record = nasty_records()[name]
    save_record(tmp_path, record)
    back = load_record(tmp_path)
    assert back.problems == []
    assert len(back.robots) == len(record.robots)


def test_parts_of_several_processes_are_put_together(tmp_path: Path) -> None:
    track = np.ones((2, 4))
    save_record_part(
        tmp_path,
        "agent-ada",
        {"robots": {"ada": {"map_digest": "xy"}}, "events": [{"t_s": 1.0, "event": "a"}]},
    )
    save_record_part(
        tmp_path,
        "server",
        {
            "robots": {"ada": {"track_map": track, "map_digest": None}, "bob": {"scans": 3}},
            "ended": "explored",
            "events": [{"t_s": 2.0, "event": "b"}],
            "bytes": {},
        },
    )
    save_record_part(
        tmp_path,
        "world",
        {"robots": {"bob": {"track_world": track}}, "bytes": {"bid": {"count": 1, "bytes": 2}}},
    )
    record = load_record(tmp_path)
    ada, bob = record.robots
    assert (ada.map_digest, len(ada.track_map)) == ("xy", 2)
    assert (bob.scans, bob.track_world is not None) == (3, True)
    assert record.ended == "explored"
    assert [event["event"] for event in record.events] == ["a", "b"]
    assert record.bytes == {"bid": {"count": 1, "bytes": 2}}


def test_a_grid_is_taken_whole_from_one_part(tmp_path: Path) -> None:
    old = OccupancyGrid.unknown(GridGeometry(0.1, 0.0, 0.0, 2, 3))
    new = OccupancyGrid.unknown(GridGeometry(0.2, 1.0, 0.0, 4, 3))
    save_record_part(tmp_path, "a", {"grid": old})
    save_record_part(tmp_path, "b", {"grid": new})
    save_record_part(tmp_path, "c", {"grid": None})
    record = load_record(tmp_path)
    assert record.grid is not None
    assert record.grid.geometry == new.geometry
    assert record.grid.log_odds.shape == (4, 3)


def test_a_later_part_of_the_same_name_replaces_the_earlier(tmp_path: Path) -> None:
    save_record_part(tmp_path, "server", {"seed": 1})
    save_record_part(tmp_path, "server", {"seed": 2})
    assert load_record(tmp_path).seed == 2


def test_what_cannot_be_read_is_named_and_left_out(tmp_path: Path) -> None:
    good = save_record_part(tmp_path, "world", {"seed": 4, "config": {"a": np.zeros(50)}})
    content = good.read_bytes()
    (tmp_path / "a.npz").write_bytes(b"no such thing")
    (tmp_path / "b.npz").write_bytes(content[: len(content) // 2])
    (tmp_path / "c.npz").write_bytes(b"")
    np.savez(tmp_path / "d.npz", tree=np.frombuffer(b"[1]", dtype=np.uint8))
    np.savez(tmp_path / "e.npz", other=np.zeros(2))
    save_record_part(tmp_path, "f", {"truth": {"solid": 3}})
    record = load_record(tmp_path)
    assert record.seed == 4
    assert len(record.problems) == 6
    assert "a.npz" in record.problems[0]
    assert "truth" in record.problems[-1]


def test_no_parts_at_all(tmp_path: Path) -> None:
    record = load_record(tmp_path / "missing")
    assert record.ended == "failed"
    assert record.robots == [] and record.problems == []


def test_unknown_fields_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no colour, taste"):
        save_record_part(tmp_path, "x", {"taste": 1, "colour": 2})


def test_robots_in_order() -> None:
    assert [robot.id for robot in full_record().robots_in_order()] == ["ada", "bob"]
    assert RunRecord().robots_in_order() == []
    assert no_rows(3).shape == (0, 3)
