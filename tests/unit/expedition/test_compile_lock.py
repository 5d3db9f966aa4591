from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from expedition import compile_lock
from expedition.compile_lock import WAITING, only_one

ROOT = Path(__file__).parents[3]

HOLDER = """
import sys
from pathlib import Path
from expedition.compile_lock import only_one
with only_one(Path(sys.argv[1]), print):
    print("mine", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def holder(tmp_path: Path) -> subprocess.Popen[str]:
    """Another process, which holds the lock until it is told to let go."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "mine\n"
    return process


def let_go(process: subprocess.Popen[str]) -> None:
    process.communicate("\n", timeout=20.0)


def test_who_comes_second_waits_and_says_so_once(
    tmp_path: Path, holder: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    naps: list[float] = []

    def sleep(seconds: float) -> None:
        naps.append(seconds)
        if len(naps) == 3:
            let_go(holder)

    monkeypatch.setattr(compile_lock, "time", SimpleNamespace(sleep=sleep))
    with only_one(tmp_path, told.append):
        assert told == [WAITING] and len(naps) == 3


def test_who_is_interrupted_waits_no_longer(tmp_path: Path, holder: subprocess.Popen[str]) -> None:
    with only_one(tmp_path, lambda text: None, lambda: False):
        pass
    let_go(holder)


def test_a_process_that_was_killed_holds_nothing(
    tmp_path: Path, holder: subprocess.Popen[str]
) -> None:
    holder.kill()
    holder.communicate()
    told: list[str] = []
    with only_one(tmp_path, told.append):
        assert told == []


def test_where_nothing_can_be_kept_there_is_no_lock(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with only_one(tmp_path / "file" / "cache", pytest.fail):
        pass
