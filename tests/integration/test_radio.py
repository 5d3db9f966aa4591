"""A ready-made team over a radio that is slow, loses frames and ends somewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.integration.teams import play

LOSSY = (
    "world.radio.model='path_loss'",
    "world.radio.capacity_bit_s=1e6",
    "world.radio.latency_s=0.15",
    "world.radio.jitter_s=0.2",
    "world.radio.loss=0.1",
    "world.radio.duplication=0.05",
    "world.radio.reordering=0.05",
    "world.radio.partitions=[{start_s = 8.0, duration_s = 4.0, groups = [['robot2']]}]",
)
BOOKS = ("sent", "duplicated", "delivered", "lost", "queued")


def reconcile(summary: dict[str, Any]) -> None:
    """Every frame and byte of every link and message type is somewhere."""
    for link in summary["links"].values():
        for books in [link, *link["types"].values()]:
            for what in ("count", "bytes"):
                held = {name: books.get(name, {what: 0})[what] for name in BOOKS}
                gone = held["delivered"] + held["lost"] + held["queued"]
                assert held["sent"] + held["duplicated"] == gone
    for robot in summary["robots"]:
        to = [v for k, v in summary["links"].items() if k.endswith(f">{robot['id']}")]
        assert robot["bytes_received"] == sum(link["delivered"]["bytes"] for link in to)
        own = [v for k, v in summary["links"].items() if k.startswith(f"{robot['id']}>")]
        assert robot["bytes_sent"] == sum(link["sent"]["bytes"] for link in own)


def test_a_team_gets_along_with_a_lossy_radio_and_no_frame_is_unaccounted_for(
    tmp_path: Path,
) -> None:
    summary = play(tmp_path, *LOSSY, in_process=True, max_time=30.0)
    assert summary["ended"] == "time_limit"
    assert summary["coverage"] > 0.05
    assert summary["problems"] == []
    links = summary["links"]
    assert set(links) == {"robot1>server", "robot2>server", "server>robot1", "server>robot2"}
    reconcile(summary)
    for name, link in links.items():
        lost = link["lost"]["count"] / link["sent"]["count"]
        assert (0.04 if "robot1" in name else 0.1) < lost < 0.4
        assert link["duplicated"]["count"] > 0
    for name, types in summary["aired"].items():
        sent = [link["sent"]["count"] for key, link in links.items() if key.startswith(f"{name}>")]
        assert 0.9 * sum(sent) < sum(entry["count"] for entry in types.values()) <= sum(sent)


@pytest.mark.slow
def test_a_lossy_radio_repeats_exactly_over_sockets(tmp_path: Path) -> None:
    sockets = play(tmp_path / "a", *LOSSY)
    here = play(tmp_path / "b", *LOSSY, in_process=True)
    assert sockets["digest"] == here["digest"]
    for key in ("ended", "coverage", "bytes", "links", "aired", "robots"):
        assert sockets[key] == here[key], key
    reconcile(sockets)
