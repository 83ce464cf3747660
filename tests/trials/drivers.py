"""Runs `clrt devices` with drivers that abort, hang, crash, refuse, are empty or missing, and two PoCLs: limit 10 s."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ..device.fake_drivers import FAULTS, listed, make_driver, run

LIMIT = 10.0
SYSTEM = Path("/etc/OpenCL/vendors/pocl.icd")


def trial() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "vendors").mkdir()
        (folder / "scene.toml").write_text("[render]\nsize = [16, 16]\nspp = 4\n[[sphere]]\n")
        yield answered(folder, "pip's alone")
        if SYSTEM.exists():
            (folder / "vendors" / "pocl.icd").write_text(SYSTEM.read_text())
            yield answered(folder, "and the system's PoCL")
        for name, choices in FAULTS.items():
            make_driver(folder / "vendors", name, **choices)
        (folder / "vendors" / "missing.icd").write_text("/nowhere/libmissing.so\n")
        yield answered(folder, "and all that are broken")
        for row in listed(folder):
            if not row["usable"]:
                yield f"    {Path(row['name']).stem:16} {row['why']}"
        start = time.perf_counter()
        rendered = run(folder, "-m", "clrt", "render", "scene.toml", "-q")
        yield f"a render beside them: exit code {rendered.returncode}, {time.perf_counter() - start:.1f} s"
        (folder / "nothing").mkdir()
        none = run(folder, "-m", "clrt", "devices", OCL_ICD_VENDORS=str(folder / "vendors" / "missing.icd"))
        yield f"only one that is missing: exit code {none.returncode}: {none.stdout.strip().splitlines()[-1][:150]}"


def answered(folder: Path, what: str) -> str:
    start = time.perf_counter()
    rows = listed(folder)
    seconds = time.perf_counter() - start
    usable = [row["name"] for row in rows if row["usable"]]
    return f"{what}: {len(rows)} rows, {len(usable)} usable, {seconds:.1f} s" + (
        "" if seconds <= LIMIT else f", MORE THAN {LIMIT} s"
    )
