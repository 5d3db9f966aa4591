"""Estimators over the first minutes of a real robot's log, against relations checked by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from expedition.recordings.read import read_recording
from expedition.recordings.recording import Recording
from expedition.recordings.relations import Relation, read_relations, relation_errors
from expedition.slam_run import run_slam
from mapping.incremental_slam import SlamSettings

SCANS = 3000
# Mean errors [m], [deg] that each may have on this stretch: a fifth above what was measured. Scan
# matching comes back to where it began with what it lost on the way.
MOST = {
    "graph": (0.0187, 0.256),
    "particle_filter": (0.0205, 0.275),
    "scan_matching": (0.0394, 0.316),
}


@pytest.fixture(scope="module")
def intel(data_dir: Path) -> tuple[Recording, list[Relation]]:
    recording = read_recording(data_dir / "logs" / "intel.clf.gz")
    return (
        Recording(recording.readings[:SCANS]),
        read_relations(data_dir / "logs" / "intel.relations"),
    )


@pytest.mark.parametrize("name", sorted(MOST))
def test_a_stretch_of_the_intel_log(name: str, intel: tuple[Recording, list[Relation]]) -> None:
    recording, relations = intel
    run = run_slam(recording, name, SlamSettings(), np.random.default_rng(0), 30.0)
    errors = relation_errors(recording.stamps, run.poses, relations)
    assert len(errors.translational) > 400
    shift, turn = errors.translational_mean, math.degrees(errors.rotational_mean)
    assert shift < MOST[name][0] and turn < MOST[name][1], (shift, turn)
    assert run.unmatched <= 30
