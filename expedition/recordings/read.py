"""Recordings from files of any known format."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from expedition.recordings import carmen, rosbag
from expedition.recordings.recording import Recording, RecordingError

KNOWN = "give a CARMEN log (.log, .clf, .txt, also gzipped) or a rosbag2 (.mcap, .db3, folder)"

GZIP = b"\x1f\x8b"
ROSBAG = (b"\x89MCAP0\r\n", b"SQLite format 3\0")


def read_recording(path: Path) -> Recording:
    """Return what a log holds; its format is told by its content, not by its name.

    Raises:
        RecordingError: it is none, or cannot be read; one line that says what to do.
    """
    try:
        recording = _read(path)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise RecordingError(
            f"{path}: broken gzip file: fetch or copy it again, or unpack what is left with zcat"
        ) from None
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}: {KNOWN}") from None
    if not recording.readings:
        first = recording.skipped[0]
        raise RecordingError(
            f"{path}: none of its {len(recording.skipped)} laser readings can be used; "
            f"the first, {first.line}: {first.reason}"
        )
    return recording


def _read(path: Path) -> Recording:
    if path.is_dir():
        return rosbag.read_rosbag(_bag_in(path))
    with path.open("rb") as file:
        magic = file.read(16)
    if not magic:
        raise RecordingError(f"the file is empty: {KNOWN}")
    if magic.startswith(ROSBAG):
        return rosbag.read_rosbag(path)
    # Every byte is a character of Latin-1: what is no ASCII fails where a number is expected.
    if magic.startswith(GZIP):
        with gzip.open(path, "rt", encoding="latin-1") as lines:
            return carmen.parse(lines)
    with path.open(encoding="latin-1") as lines:
        return carmen.parse(lines)


def _bag_in(folder: Path) -> Path:
    """Return the bag that a folder is, or the only one that lies in it."""
    if (folder / "metadata.yaml").is_file():
        return folder
    bags = sorted(file for file in folder.iterdir() if file.suffix in (".mcap", ".db3"))
    if len(bags) != 1:
        raise RecordingError(
            f"a folder without metadata.yaml and with {len(bags)} bags in it: "
            "give the folder that `ros2 bag record` made, or one .mcap or .db3 file"
        )
    return bags[0]
