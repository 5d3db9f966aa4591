"""The estimators of its own way that a robot can run, by name."""

from __future__ import annotations

import importlib
from typing import cast

import numpy as np

from mapping.estimator import Estimator
from mapping.incremental_slam import SlamSettings

ESTIMATORS: dict[str, str] = {
    "graph": "mapping.graph_slam:GraphSlam",
    "particle_filter": "mapping.particle_filter:ParticleFilter",
    "scan_matching": "mapping.incremental_slam:IncrementalSlam",
}


class EstimatorError(Exception):
    """An estimator that cannot be found."""


def find_estimator(name: str) -> type:
    """Return the class of an estimator by its name in `ESTIMATORS` or "module:Class".

    Raises:
        EstimatorError: there is no such estimator.
    """
    module_name, _, class_name = ESTIMATORS.get(name, name).partition(":")
    if not class_name:
        known = ", ".join(ESTIMATORS)
        raise EstimatorError(f"no estimator '{name}': choose one of {known}, or give module:Class")
    try:
        return cast(type, getattr(importlib.import_module(module_name), class_name))
    except (ImportError, AttributeError, ValueError) as error:
        raise EstimatorError(f"cannot load estimator '{name}': {error}") from error


def make_estimator(name: str, settings: SlamSettings, rng: np.random.Generator) -> Estimator:
    """Return a new estimator, see `find_estimator`.

    Args:
        name: which one.
        settings: all that estimators have in common.
        rng: for those that draw lots.

    Raises:
        EstimatorError: there is no such estimator.
    """
    return cast(Estimator, find_estimator(name)(settings, rng))
