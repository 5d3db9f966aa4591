"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples in every run: a change that breaks something is told by the run that tests it,
# and no other. `EXPEDITION_EXPLORE=1` looks for new ones, and remembers what failed.
settings.register_profile("same", derandomize=True, deadline=None, database=None)
settings.register_profile("explore", deadline=None)
settings.load_profile("explore" if os.environ.get("EXPEDITION_EXPLORE") == "1" else "same")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real maps and logs; tests that need it are skipped where it is absent."""
    beside = Path(__file__).parent.parent.parent / "shared" / "data"
    folder = Path(os.environ.get("EXPEDITION_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"real data not found at {folder}; set EXPEDITION_DATA to its folder")
    return folder
