import json
import math
import tomllib

import numpy as np
import pytest
import yaml

from expedition.results.exports import (
    SCAN_ID_STEP,
    config_toml,
    event_log,
    events_jsonl,
    g2o,
    map_yaml,
    truth_tum,
    tum,
)
from expedition.results.record import PoseGraphRecord, RunRecord
from tests.unit.expedition.records import full_record, nasty_records


def test_map_yaml() -> None:
    content = yaml.safe_load(map_yaml(full_record()))
    assert content == {
        "image": "map.pgm",
        "mode": "trinary",
        "resolution": 0.05,
        "origin": [-1.0, -1.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    assert yaml.safe_load(map_yaml(RunRecord()))["resolution"] == 0.05


def test_tum_lines() -> None:
    text = tum(np.array([[1.5, 2.0, -3.0, math.pi / 2], [2.0, np.nan, 0.0, 0.0]]))
    assert text == "1.500000 2.000000 -3.000000 0.000000 0 0 0.707106781 0.707106781\n"
    assert tum(np.empty((0, 4))) == ""


def test_truth_has_the_stamps_of_the_estimate() -> None:
    estimate = np.array([[0.0, 0, 0, 0], [0.5, 0, 0, 0], [9.0, 0, 0, 0]])
    world = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 4.0, 0.0]])
    rows = [line.split() for line in truth_tum(estimate, world).splitlines()]
    assert [float(row[0]) for row in rows] == [0.0, 0.5, 9.0]
    assert [float(row[1]) for row in rows] == [0.0, 1.0, 2.0]
    assert truth_tum(estimate, np.empty((0, 4))) == ""


def test_g2o_of_two_robots() -> None:
    record = full_record()
    lines = g2o(record.pose_graph).splitlines()
    vertices = [line.split() for line in lines if line.startswith("VERTEX_SE2")]
    edges = [line.split() for line in lines if line.startswith("EDGE_SE2")]
    assert len(vertices) + len(edges) == len(lines)
    ids = [int(v[1]) for v in vertices]
    assert ids == [0, 1, 2, 3, *(SCAN_ID_STEP + k for k in range(4))]
    ends = [(int(e[1]), int(e[2])) for e in edges]
    assert ends == [(0, 1), (SCAN_ID_STEP, SCAN_ID_STEP + 1), (3, SCAN_ID_STEP + 3)]
    assert [float(n) for n in edges[1][3:6]] == pytest.approx([0.7, 0.1, 0.3])
    assert [float(n) for n in edges[2][6:]] == pytest.approx([1e2, 0, 0, 0, 0, 1e3])
    assert g2o(record.pose_graph) == g2o(full_record().pose_graph)


def test_g2o_leaves_out_edges_to_nowhere() -> None:
    graph = PoseGraphRecord(
        {"a": np.zeros((1, 3))},
        np.array([(0, 0, 0, 5), (0, 0, 1, 0)]),
        np.zeros((2, 3)),
        np.zeros((2, 3, 3)),
    )
    assert g2o(graph) == "VERTEX_SE2 0 0 0 0\n"
    assert g2o(PoseGraphRecord()) == ""


def test_the_event_log_is_in_order_of_time() -> None:
    events = event_log(full_record())
    times = [event["t_s"] for event in events]
    assert times == sorted(times)
    assert len(events) == 10
    assert next(iter(events[0])) == "t_s"
    assert {"source": "ada", "t_s": 0.5, "event": "ready"} in events
    lines = events_jsonl(full_record()).splitlines()
    assert [json.loads(line) for line in lines] == events
    assert events_jsonl(RunRecord()) == ""


def test_config_is_whole_and_readable() -> None:
    content = tomllib.loads(config_toml(full_record()))
    assert content["world"] == {"name": "room"}
    assert content["list"] == [1, 2]
    assert content["run"]["seed"] == 3
    assert content["run"]["robots"] == ["ada", "bob"]
    for record in nasty_records().values():
        tomllib.loads(config_toml(record))
