"""`clrt bench gpu`: what crashes or hangs is survived, results are resumed, and the figures are those of the device."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from clrt.bench.gpu import hits, measure_gpu, page, run_part
from clrt.bench.gpu.archive import read_archive, write_archive
from clrt.bench.gpu.columns import COLUMNS, rows_of
from clrt.bench.gpu.gallery import image_items, speed_items
from clrt.bench.gpu.measure_gpu import resumed
from clrt.bench.gpu.parts import PARTS
from clrt.bench.gpu.ray_rates import GroupedDevice
from clrt.bench.gpu.request import Request, Row
from clrt.bench.gpu.run_part import PartRun
from clrt.bench.gpu.shipped_scenes import shipped_scenes
from clrt.bench.rays.hard_meshes import icosphere
from clrt.bench.rays.ray_speed import scattered_rays
from clrt.device.open import Device
from clrt.device.programs.kernel_resources import kernel_resources, registers_in
from clrt.errors import UsageError
from clrt.queries.mesh import RayQuery

CORNELL = Path(__file__).parents[2] / "scenes" / "cornell.toml"
#: A child that measures items a to d, of which `{item}` ends otherwise: by `{end}`.
CHILD = """
import json, os, signal, sys, time
done = json.loads(sys.argv[1])["done"]
for name in "abcd":
    if name not in done:
        print(json.dumps({{"begins": name}}), flush=True)
        if name == "{item}":
            {end}
        print(json.dumps({{"row": {{"value": name}}}}), flush=True)
"""


def run(
    folder: Path, monkeypatch: pytest.MonkeyPatch, child: str, seconds: float = 30.0, rows: Mapping[str, Row] = {}
) -> tuple[bool, PartRun]:
    """Run a part whose child is this program; return whether nothing is left, and the run."""
    (folder / "gpu_child.py").write_text(child, "utf-8")
    monkeypatch.syspath_prepend(str(folder))
    part = PartRun("rays", Request("0", None, True, seconds), dict(rows), module="gpu_child")
    return part.run(), part


def values(part: PartRun) -> dict[str, Any]:
    return {item: row.get("value") for item, row in part.rows.items()}


@pytest.mark.parametrize(
    ("end", "told"),
    [("os.kill(os.getpid(), signal.SIGSEGV)", "signal 11"), ("sys.exit('the device is gone')", "the device is gone")],
)
def test_an_item_that_crashes_is_recorded_and_the_others_follow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str, told: str
) -> None:
    done, part = run(tmp_path, monkeypatch, CHILD.format(item="b", end=end))
    assert done and not part.failure and values(part) == {"a": "a", "b": None, "c": "c", "d": "d"}
    assert told in part.rows["b"]["error"]


def test_an_item_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_part, "LEAST", 2.0)
    monkeypatch.setattr(run_part, "MOST", 0.1)
    done, part = run(tmp_path, monkeypatch, CHILD.format(item="c", end="time.sleep(100)"), 20.0)
    assert not done and values(part) == {"a": "a", "b": "b", "c": None, "d": "d"}
    assert part.rows["c"]["error"] == "it did not finish in 2 s" and part.seconds < 15
    done, part = run(tmp_path, monkeypatch, CHILD.format(item="a", end="sys.exit(1)"), rows=part.rows)
    assert done and values(part) == {"a": "a", "b": "b", "c": "c", "d": "d"}, "tried again"


def test_what_a_hanging_item_started_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pid = tmp_path / "pid"
    child = f"""import subprocess
            with open({str(pid)!r}, "w") as file:
                file.write(str(subprocess.Popen(["sleep", "100"]).pid))
            time.sleep(100)"""
    run(tmp_path, monkeypatch, CHILD.format(item="a", end=child), 6.0)
    status, end = Path(f"/proc/{pid.read_text()}/stat"), time.monotonic() + 10
    while runs(status):
        assert time.monotonic() < end
        time.sleep(0.05)


def runs(status: Path) -> bool:
    """Return whether a process has not ended; its parent may still have to wait for it."""
    try:
        return status.read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def test_a_part_whose_time_is_over_keeps_what_it_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done, part = run(tmp_path, monkeypatch, CHILD.format(item="c", end="time.sleep(100)"), 2.0)
    assert not done and not part.failure and values(part) == {"a": "a", "b": "b"}
    done, part = run(tmp_path, monkeypatch, CHILD.format(item="a", end="sys.exit(1)"), rows=part.rows)
    assert done and values(part) == {"a": "a", "b": "b", "c": "c", "d": "d"}


def test_a_part_that_cannot_begin_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done, part = run(tmp_path, monkeypatch, "raise OSError('no such driver')")
    assert done and part.rows == {} and "no such driver" in part.failure


def test_results_are_read_as_written_and_others_refused(tmp_path: Path) -> None:
    path, results = tmp_path / "gpu.zip", {"identity": {"device": "1", "quick": True}, "parts": {"a": [1, 2.5, None]}}
    assert read_archive(path) is None
    assert read_archive(write_archive(path, results, "<html>")) == results
    with ZipFile(path) as archive:
        assert archive.read("gpu.html") == b"<html>"
    path.write_bytes(b"PK")
    with pytest.raises(UsageError, match=r"gpu\.zip: is not a file of `clrt bench gpu`"):
        read_archive(path)


def test_only_results_of_the_same_device_are_resumed() -> None:
    new: dict[str, Any] = {"identity": {"device": "1", "driver": "2"}, "device": {}, "other": None, "parts": {}}
    before = {**new, "parts": {"rays": {"state": "done"}}}
    assert resumed(new, None, Path("a")) == new and resumed(new, before, Path("a")) == before
    with pytest.raises(UsageError, match="of another driver; choose another file, or replace them with --fresh"):
        resumed(new, {**before, "identity": {"device": "1", "driver": "3"}}, Path("a"))


def test_parts_share_the_time_and_what_others_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every part takes all its time but the first, which takes none."""
    given: dict[str, float] = {}

    def fake(name: str, part: Row, request: Request, on_item: object) -> None:
        time.sleep(request.seconds if given else 0)
        given[name] = request.seconds

    monkeypatch.setattr(measure_gpu, "_measure_part", fake)
    monkeypatch.setattr(measure_gpu, "LEAST", 0.0)
    results = {"parts": {"calls": {"state": "done"}}, "device": {"id": "0"}, "other": None, "identity": {"quick": True}}
    start, seconds = time.monotonic(), 2.0
    measure_gpu.measure_gpu(results, [], seconds)
    assert list(given) == [name for name in PARTS if name != "calls"]
    assert time.monotonic() - start == pytest.approx(seconds, abs=0.3)
    first, *others = given
    shares = {name: PARTS[name].share for name in given}
    assert given[first] == pytest.approx(seconds * shares[first] / sum(shares.values()), rel=0.05)
    for name in others:
        expected = seconds * shares[name] / (sum(shares.values()) - shares[first])
        assert given[name] == pytest.approx(expected, rel=0.3, abs=0.02)


def test_differing_hits_are_counted() -> None:
    way = {"layout": "bvh2", "rays": 8, "differ": {"random": 0, "edges": 0}}
    ways = [way, {**way, "differ": {"random": 2, "edges": 1}}, {"layout": "list", "error": "it crashed"}]
    digests = {"rays": "r", "hits": "h"}
    result = {"triangles": 4, "rays": 8, "ways": ways, "exact": {"wrong": 5}, "escaped": 0, "digests": digests}
    row = hits.summary(result, {"r": "h"})
    assert (row["differ"], row["wrong"], row["configurations"], row["failures"]) == (3, 5, 2, "it crashed")
    assert [hits.summary(result, known)["stored"] for known in ({"r": "h"}, {"r": "g"}, {"q": "h"})] == [
        True,
        False,
        None,
    ]


def test_hits_have_the_stored_digests(device: Device) -> None:
    """Those of PoCL, from which no device may differ; numpy's sines, and so the bumpy ball, may."""
    rows = {item.name: item.measure() for item in hits.items(Request(device.info.id, None, True, 100.0))}
    assert {name: row["stored"] for name, row in rows.items() if name != "bumpy ball"} == {
        "icosphere": True,
        "soup": True,
    }
    assert rows["bumpy ball"]["stored"] is not False
    assert all(row["differ"] == row["wrong"] == 0 and not row["failures"] for row in rows.values())


def test_group_sizes_leave_hits_unchanged(device: Device) -> None:
    vertices, faces = icosphere(3)
    rays, answers = scattered_rays(vertices, 1000), []
    for group in (1, 3, 16):
        query = RayQuery(vertices, faces, device=device.info.index)
        query.device = GroupedDevice.of(query.device, group)
        assert query.device.local_size == group
        answers.append(query.closest_hit(*rays))
    assert np.array_equal(answers[0], answers[1]) and np.array_equal(answers[0], answers[2])
    assert 300 < np.sum(answers[0]["primitive"] >= 0) < 1000


def test_images_are_compared_and_all_paths_measured(device: Device) -> None:
    request = Request(device.info.id, device.info.id, True, 100.0, [str(CORNELL)])
    *_, image = image_items(request)
    row = image.measure()
    assert image.name == "cornell" and (row["ratio"], row["equal"], row["near"], row["finite"]) == (1, 1, 1, True)
    assert 0.5 < row["reference_ratio"] < 2
    rows = [item.measure() for item in speed_items(request)]
    assert len(rows) > 1 and all(row["msamples"] > 0 and row["mrays"] > row["msamples"] for row in rows)
    assert rows[0]["mean"] == pytest.approx(rows[1]["mean"], rel=0.1), "of different numbers of samples"


LOG = """
ptxas info    : 0 bytes gmem
ptxas info    : Compiling entry function 'megakernel' for 'sm_90'
ptxas info    : Function properties for megakernel
ptxas         .     520 bytes stack frame, 16 bytes spill stores, 24 bytes spill loads
ptxas info    : Used 255 registers, 520 bytes cumulative stack size, 512 bytes cmem[0]
ptxas info    : Compiling entry function 'clear' for 'sm_90'
ptxas info    : Used 8 registers, 360 bytes cmem[0]
"""


def test_registers_are_read_from_the_log_of_nvidias_compiler() -> None:
    assert registers_in(LOG) == {
        "megakernel": {"registers": 255, "stack_bytes": 520, "spill_store_bytes": 16, "spill_load_bytes": 24},
        "clear": {"registers": 8},
    }
    assert registers_in("") == {}


def test_drivers_report_the_memory_of_kernels(device: Device) -> None:
    source = "kernel void a(global int *x, local int *y) {local int z[64]; z[get_local_id(0)] = x[0]; x[1] = z[0];}"
    (name, told), *others = kernel_resources(device, source).items()
    assert name == "a" and not others and told["local_bytes"] >= 256 and told["largest_group"] >= 1


def test_scenes_ship() -> None:
    assert {path.name for path in shipped_scenes()} == {path.name for path in CORNELL.parent.glob("*.toml")}


def test_the_command_measures_resumes_and_shows_everything(device: Device, tmp_path: Path) -> None:
    path = tmp_path / "gpu.zip"
    command = [
        sys.executable,
        "-m",
        "clrt",
        "bench",
        "gpu",
        str(CORNELL),
        "--quick",
        "--device",
        str(device.info.index),
        "-o",
        str(path),
    ]
    first = subprocess.run([*command, "--minutes", "0.1"], capture_output=True, text=True)
    assert first.returncode == 0 and "to be completed" in first.stdout, first.stderr
    before = read_archive(path) or {}
    done = {f"{name}: {item}" for name, part in before["parts"].items() for item in part["rows"]}
    whole = subprocess.run(command, capture_output=True, text=True)
    assert whole.returncode == 0 and not done & set(whole.stderr.splitlines()), whole.stderr
    with ZipFile(path) as archive:
        results, html = json.loads(archive.read("gpu.json")), archive.read("gpu.html").decode()
    assert list(results["parts"]) == list(PARTS)
    for name, part in results["parts"].items():
        failed = [item for item, row in part["rows"].items() if "error" in row]
        assert part["state"] == "done" and (not failed or name == "groups"), "drivers of CPUs have only small groups"
        assert PARTS[name].title in html and all(item in html for item in rows_of(part)), name
        keys = {key for row in rows_of(part).values() for key in row}
        unknown = {column.key for column in COLUMNS.get(name, ())} - keys
        assert unknown <= {"registers", "spill_store_bytes", "stack_bytes"} or name in ("peers", "images"), name
    assert html.count("<svg") == 7
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode == 0 and again.stderr.count("\n") == whole.stderr.count("pthread") <= 1, again.stderr


def test_without_matplotlib_the_page_has_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    row = {"layout": "bvh2", "kind": "primary", "mrays": 12.5}
    named = dict.fromkeys(("name", "platform", "platform_version", "driver"), "<x>")
    results = {
        "device": {**named, "compute_units": 2, "global_bytes": 1 << 30},
        "other": None,
        "system": {"begun": "now", "system": "Linux", "python": "3"},
        "identity": {"clrt": "1", "kernels": "0123", "quick": False},
        "parts": {"rays": {"state": "done", "seconds": 1.0, "rows": {"one": row, "two": {"error": "a < b"}}}},
    }
    html = page.page_of(results)
    assert "<svg" in html and "12.5" in html and "a &lt; b" in html and "<x>" not in html
    monkeypatch.setattr(page, "find_spec", lambda name: None)
    assert page.page_of(results).count("<tr>") == html.count("<tr>") and "<svg" not in page.page_of(results)
