"""Reports are valid JSON, written completely or not at all."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.errors import OutputError
from clrt.output.report import write_report


def refuse(constant: str) -> Any:
    raise AssertionError(f"{constant} is not JSON")


def test_values_arrive(tmp_path: Path) -> None:
    report = {
        "scene": "café",
        "spp": 64,
        "noise": 0.1,
        "cached": True,
        "none": None,
        "path": tmp_path,
        "bvh": {"nodes": np.int64(7), "seconds": np.float64(0.25), "saved": np.bool_(True)},
        "ratio": (1.0, 2.0),
        "history": [{"spp": 1, "noise": math.nan}, {"spp": 2, "noise": np.float32(np.inf)}],
        "mean": np.array([0.5, -math.inf]),
    }
    write_report(tmp_path / "report.json", report)
    back = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert back == {
        "scene": "café",
        "spp": 64,
        "noise": 0.1,
        "cached": True,
        "none": None,
        "path": str(tmp_path),
        "bvh": {"nodes": 7, "seconds": 0.25, "saved": True},
        "ratio": [1, 2],
        "history": [{"spp": 1, "noise": None}, {"spp": 2, "noise": None}],
        "mean": [0.5, None],
    }


def test_what_is_no_json_leaves_the_old_report(tmp_path: Path) -> None:
    write_report(tmp_path / "report.json", {"spp": 1})
    with pytest.raises(TypeError):
        write_report(tmp_path / "report.json", {"spp": object()})
    assert json.loads((tmp_path / "report.json").read_text()) == {"spp": 1}
    assert os.listdir(tmp_path) == ["report.json"]


@pytest.mark.parametrize(
    "name, message",
    [("missing/r.json", "create it first"), ("folder", "is a folder"), ("/proc/r.json", "no file can be written")],
)
def test_unwritable_reports_are_output_errors(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match=message):
        write_report(tmp_path / name, {})
