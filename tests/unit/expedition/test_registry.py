import inspect
import typing

import pytest

from expedition.experiments.experiment import (
    ExperimentOptions,
    ExperimentResult,
    describe,
    load_experiment,
)
from expedition.experiments.registry import EXPERIMENTS


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_keeps_the_form(name: str) -> None:
    entry = EXPERIMENTS[name]
    module = name.replace("-", "_")
    assert entry == f"expedition.experiments.{module}:run"
    experiment = load_experiment(entry)
    assert list(inspect.signature(experiment).parameters) == ["options"]
    assert typing.get_type_hints(experiment) == {
        "options": ExperimentOptions,
        "return": ExperimentResult,
    }
    assert 10 < len(describe(entry)) < 100
