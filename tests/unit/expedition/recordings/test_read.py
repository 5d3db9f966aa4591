from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from expedition.recordings.read import read_recording
from expedition.recordings.recording import RecordingError
from tests.unit.expedition.recordings.logs import log

TEXT = "\n".join(log(30)) + "\n"


@pytest.mark.parametrize("name", ["a.log", "a.clf", "a.txt", "a", "a.gz"])
def test_text_by_any_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(TEXT)
    assert len(read_recording(tmp_path / name).readings) == 30


def test_gzip_by_any_name(tmp_path: Path) -> None:
    for name in ("a.clf.gz", "a.log"):
        (tmp_path / name).write_bytes(gzip.compress(TEXT.encode()))
        assert len(read_recording(tmp_path / name).readings) == 30


def test_foreign_line_ends_and_bytes(tmp_path: Path) -> None:
    text = TEXT.replace("\n", "\r\n").encode() + b"FLASER \xff\xfe\n\x80\x00\n"
    (tmp_path / "a.log").write_bytes(text)
    recording = read_recording(tmp_path / "a.log")
    assert len(recording.readings) == 30
    assert [part.line for part in recording.skipped] == [32]


def broken(folder: Path) -> dict[str, Path]:
    """Return paths that are no recordings, by what their error speaks of."""
    packed = gzip.compress(TEXT.encode())
    contents = {
        "empty": b"",
        "no laser readings": bytes(range(256)) * 50,
        "broken gzip": packed[: len(packed) // 2],
        "broken gzip file": packed[:40] + bytes(20) + packed[60:],
        "none of its 2": b"FLASER 3 x\nROBOTLASER1\n",
        "rename": b"SQLite format 3\0" + bytes(100),
    }
    paths = {}
    for number, (words, content) in enumerate(contents.items()):
        paths[words] = folder / f"{number}.log"
        paths[words].write_bytes(content)
    (folder / "bag").mkdir()
    (folder / "bag.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(50))
    (folder / "bag.db3").write_bytes(b"SQLite format 3\0" + bytes(500))
    (folder / "meta").mkdir()
    (folder / "meta" / "metadata.yaml").write_text("a: [")
    paths["with 0 bags"] = folder / "bag"
    paths["No such file"] = folder / "absent.log"
    paths["broken ROS bag"] = folder / "bag.mcap"
    paths["broken ROS"] = folder / "bag.db3"
    paths["broken"] = folder / "meta"
    return paths


def test_what_is_no_recording_is_told_in_one_line(tmp_path: Path) -> None:
    for words, path in broken(tmp_path).items():
        with pytest.raises(RecordingError) as raised:
            read_recording(path)
        said = str(raised.value)
        assert words in said
        assert said.startswith(str(path))
        assert "\n" not in said
