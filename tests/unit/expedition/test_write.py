import json
from pathlib import Path

import pytest

from expedition.results import write as module
from expedition.results.write import write_results
from tests.unit.expedition.records import full_record, nasty_records

FILES = {
    "config.toml", "events.jsonl", "map.pgm", "map.png", "map.yaml", "pose_graph.g2o",
    "report.html", "summary.json",
}  # fmt: skip


def found(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


def test_everything_is_written(tmp_path: Path) -> None:
    summary = write_results(full_record(), tmp_path / "out")
    assert found(tmp_path / "out") == FILES | {
        "trajectories/ada.tum", "trajectories/bob.tum", "truth/ada.tum", "truth/bob.tum",
    }  # fmt: skip
    assert json.loads((tmp_path / "out/summary.json").read_text()) == summary
    assert summary["problems"] == []


@pytest.mark.parametrize("name", nasty_records())
def test_nasty_runs_are_written_whole(tmp_path: Path, name: str) -> None:
    summary = write_results(nasty_records()[name], tmp_path / "out")
    assert summary["problems"] == []
    assert found(tmp_path / "out") >= FILES
    assert [p.name for p in tmp_path.iterdir()] == ["out"]  # nothing got out of the folder


def test_the_same_record_gives_the_same_bytes(tmp_path: Path) -> None:
    for out in ("a", "b"):
        write_results(full_record(), tmp_path / out)
    for name in found(tmp_path / "a"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_one_bad_file_does_not_cost_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: object) -> bytes:
        raise ZeroDivisionError("no picture")

    monkeypatch.setattr(module, "map_png", broken)
    (tmp_path / "map.yaml").mkdir()
    (tmp_path / "map.yaml" / "in the way").touch()
    summary = write_results(full_record(), tmp_path)
    assert found(tmp_path) >= FILES - {"map.png", "map.yaml"}
    assert len(summary["problems"]) == 2
    assert "map.png failed: ZeroDivisionError: no picture" in summary["problems"]
    assert json.loads((tmp_path / "summary.json").read_text())["problems"] == summary["problems"]


def test_two_robots_whose_names_make_one_file(tmp_path: Path) -> None:
    record = full_record()
    record.robots[0].id, record.robots[1].id = "a/b", "a_b"
    write_results(record, tmp_path)
    assert {"trajectories/a_b.tum", "trajectories/a_b-2.tum"} <= found(tmp_path)
