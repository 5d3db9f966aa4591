import csv
import io
import json
from pathlib import Path

import numpy as np

from expedition.experiments.experiment import Claim, ExperimentResult
from expedition.experiments.tables import (
    cell,
    claims_text,
    csv_table,
    result_value,
    spread,
    text_table,
    write_tables,
)

ROWS = [
    {"world": "a", "robots": 1, "time_s": 12.34567, "ok": True},
    {"world": "b,c", "robots": 16, "time_s": None, "ok": False},
]
RESULT = ExperimentResult("sample", ROWS, [Claim("it works", True, "1"), Claim("x", False, "0")])


def test_text_is_aligned() -> None:
    assert text_table(ROWS).splitlines() == [
        "world  robots  time_s  ok",
        "-----  ------  ------  ---",
        "a           1   12.35  yes",
        "b,c        16       -  no",
    ]
    assert text_table([]) == "(no rows)\n"


def test_cells() -> None:
    assert [cell(v) for v in (np.float64(0.5), 123456.7, np.int64(3), "x", float("nan"))] == [
        "0.5", "123457", "3", "x", "-",
    ]  # fmt: skip


def test_csv_can_be_read_back() -> None:
    rows = list(csv.DictReader(io.StringIO(csv_table(ROWS))))
    assert rows[1] == {"world": "b,c", "robots": "16", "time_s": "", "ok": "False"}
    assert float(rows[0]["time_s"]) == 12.34567


def test_rows_need_not_have_the_same_columns() -> None:
    assert csv_table([{"a": 1}, {"b": 2}]) == "a,b\n1,\n,2\n"


def test_value_and_claims() -> None:
    value = result_value(RESULT)
    assert list(value) == ["name", "rows", "claims"]
    assert value["claims"][1] == {"claim": "x", "holds": False, "figure": "0"}
    assert claims_text(RESULT) == "holds  it works  [1]\nFAILS  x  [0]\n"


def test_files(tmp_path: Path) -> None:
    paths = write_tables(RESULT, tmp_path / "out")
    assert [p.name for p in paths] == ["sample.txt", "sample.csv", "sample.json"]
    assert json.loads(paths[2].read_text()) == result_value(RESULT)


def test_spread() -> None:
    assert spread([3.0, None, 1.0, 2.0]) == {"min": 1.0, "median": 2.0, "max": 3.0}
    assert spread([None]) == {"min": None, "median": None, "max": None}
