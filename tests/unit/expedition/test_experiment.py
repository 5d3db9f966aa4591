import math
from pathlib import Path

import pytest

from expedition.experiments.experiment import (
    ExperimentOptions,
    ExperimentResult,
    describe,
    load_experiment,
    run_all,
)


def sample(options: ExperimentOptions) -> ExperimentResult:
    """A sample experiment.

    More about it.
    """
    return ExperimentResult("sample", [{"seeds": options.seeds}])


def test_an_experiment_is_found_by_its_entry() -> None:
    found = load_experiment(f"{__name__}:sample")
    result = found(ExperimentOptions(True, 1, 3, Path()))
    assert result.rows == [{"seeds": 3}]
    assert result.claims == []
    assert describe(f"{__name__}:sample") == "A sample experiment."


@pytest.mark.parametrize("entry", ["sample", ":run", "module:"])
def test_a_wrong_entry_is_refused(entry: str) -> None:
    with pytest.raises(ValueError, match="module:function"):
        load_experiment(entry)


def test_jobs_come_back_in_order() -> None:
    assert run_all(math.sqrt, [4.0, 9.0]) == [2.0, 3.0]
    assert run_all(math.sqrt, [4.0], workers=4) == [2.0]
    assert run_all(math.sqrt, [float(i * i) for i in range(6)], workers=2) == [
        0.0, 1.0, 2.0, 3.0, 4.0, 5.0,
    ]  # fmt: skip
