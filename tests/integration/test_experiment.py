"""`expedition experiment` and `expedition list`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from expedition.experiments.experiment import Claim, ExperimentOptions, ExperimentResult
from tests.integration.command_line import Outcome

Cli = Callable[..., Outcome]
SEEN: list[ExperimentOptions] = []


def tiny(options: ExperimentOptions) -> ExperimentResult:
    """A table of one row."""
    SEEN.append(options)
    claims = [Claim("two is more than one", True, "2 > 1"), Claim("less", False, "2 < 1")]
    return ExperimentResult("tiny", [{"robots": 2, "time_s": 1.5}], claims)


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from expedition.experiments.registry import EXPERIMENTS

    monkeypatch.setitem(EXPERIMENTS, "tiny", f"{__name__}:tiny")
    monkeypatch.chdir(tmp_path)
    SEEN.clear()


def test_an_experiment_gives_table_claims_and_json(cli: Cli, tmp_path: Path) -> None:
    words = ("--quick", "--workers", "2", "--seeds", "3", "--out", "out", "--json")
    outcome = cli("experiment", "tiny", *words)
    assert (outcome.status, outcome.stderr) == (0, "")
    assert json.loads(outcome.stdout) == {
        "name": "tiny",
        "rows": [{"robots": 2, "time_s": 1.5}],
        "claims": [
            {"claim": "two is more than one", "holds": True, "figure": "2 > 1"},
            {"claim": "less", "holds": False, "figure": "2 < 1"},
        ],
    }
    (seen,) = SEEN
    assert (seen.quick, seen.workers, seen.seeds) == (True, 2, 3)
    assert any("robots" in path.read_text() for path in (tmp_path / "out").glob("*.csv"))


def test_an_experiment_tells_people_what_holds(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("experiment", "tiny")
    assert "holds: two is more than one (2 > 1)" in outcome.stdout
    assert "DOES NOT HOLD: less (2 < 1)" in outcome.stdout
    assert (tmp_path / "runs" / "experiment-tiny").is_dir()


def test_the_list_names_everything_with_one_line_each(cli: Cli) -> None:
    text = cli("list").stdout
    for word in ("teams", "auction", "worlds", "hospital", "strategies", "nearest", "experiments"):
        assert word in text
    catalogue = json.loads(cli("list", "--json").stdout)
    assert all(line for names in catalogue.values() for line in names.values())
