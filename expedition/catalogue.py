"""What there is to choose from: teams, worlds, strategies, estimators, experiments."""

from __future__ import annotations

import importlib
import tomllib

from coordination.strategy import STRATEGIES
from expedition.experiments.registry import EXPERIMENTS
from expedition.team import ready_made
from robot_agent.estimators import ESTIMATORS
from sim_world.world_file import shipped_worlds


def catalogue() -> dict[str, dict[str, str]]:
    """Return names and one line each, by kind."""
    return {
        "teams": {
            name: str(tomllib.loads(path.read_text(encoding="utf-8")).get("description", ""))
            for name, path in ready_made().items()
        },
        "worlds": shipped_worlds(),
        "strategies": {name: _first_line(target) for name, target in STRATEGIES.items()},
        "estimators": {name: _first_line(target) for name, target in ESTIMATORS.items()},
        "experiments": {name: _first_line(target) for name, target in EXPERIMENTS.items()},
    }


def _first_line(target: str) -> str:
    """Return the first line of the docstring of "module:name"."""
    module, _, name = target.partition(":")
    documented = getattr(importlib.import_module(module), name).__doc__ or ""
    return documented.strip().splitlines()[0] if documented.strip() else ""
