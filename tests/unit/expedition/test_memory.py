from __future__ import annotations

import ctypes
import gc
import platform

import pytest

from expedition.memory import collect_seldom, keep_freed_memory


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only the GNU C library has it")
def test_the_gnu_library_takes_the_wish() -> None:
    assert keep_freed_memory()


def test_another_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    assert not keep_freed_memory()


def test_the_collector_of_cycles_works_less_often() -> None:
    before = gc.get_threshold()
    try:
        collect_seldom()
        assert gc.get_threshold()[0] > 10 * 700
    finally:
        gc.set_threshold(*before)
