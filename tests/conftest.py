"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real maps and logs; tests that need it are skipped where it is absent."""
    beside = Path(__file__).parent.parent.parent / "shared" / "data"
    folder = Path(os.environ.get("EXPEDITION_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"real data not found at {folder}; set EXPEDITION_DATA to its folder")
    return folder
