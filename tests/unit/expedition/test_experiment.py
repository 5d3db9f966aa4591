import math
import os
import subprocess
import sys
import time
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


def rest(seconds: float) -> None:
    """A job that only takes time; it says which process does it."""
    print(os.getpid(), flush=True)
    time.sleep(seconds)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells them")
def test_workers_end_with_the_process_that_started_them() -> None:
    script = f"from {__name__} import rest, run_all; run_all(rest, [60.0, 60.0], workers=2)"
    root = Path(__file__).parents[3]
    guarded = f"if __name__ == '__main__':\n    {script.replace('; ', chr(10) + '    ')}\n"
    with subprocess.Popen(
        [sys.executable, "-c", guarded], cwd=root, stdout=subprocess.PIPE, text=True
    ) as started:
        assert started.stdout is not None
        workers = [int(started.stdout.readline()) for _ in range(2)]
        started.kill()
        started.wait()
        deadline = time.monotonic() + 10.0
        while any(Path(f"/proc/{pid}").exists() for pid in workers):
            assert time.monotonic() < deadline, "a worker lives on"
            time.sleep(0.05)
