"""pytest refuses to run if the installed clrt comes from another tree."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from .this_tree import HOUSE, differing, other_file

CHANGES: dict[str, Callable[[Path], object]] = {
    "scene/model.py": lambda file: file.write_text("# another\n"),
    "scene/new.py": lambda file: file.write_text(""),
    "device/cache_files.py": lambda file: file.unlink(),
    "device": lambda folder: shutil.rmtree(folder),
}


def test_the_imported_packages_are_this_trees() -> None:
    assert other_file() is None


@pytest.mark.parametrize("changed", CHANGES)
def test_any_other_source_file_is_seen(tmp_path: Path, changed: str) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    shutil.copytree(HOUSE / "clrt", one)
    shutil.copytree(one, other)
    assert differing(one, other) is None
    CHANGES[changed](other / changed)
    for found in (differing(one, other), differing(other, one)):
        assert found is not None and found.startswith(changed)


def test_a_run_in_another_tree_ends_before_its_first_test(tmp_path: Path) -> None:
    for folder in ("clrt", "kernels", "tests"):
        shutil.copytree(HOUSE / folder, tmp_path / "tree" / folder)
    shutil.copy(HOUSE / "setup.cfg", tmp_path / "tree")
    with open(tmp_path / "tree" / "kernels" / "core/lanes.cl", "a", encoding="utf-8") as kernel:
        kernel.write("// another\n")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "tests/bench/test_significance.py"],
        cwd=tmp_path / "tree",
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONSAFEPATH": "1"},
    )
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert "clrt.kernels: core/lanes.cl" in done.stderr and "pip install" in done.stderr
    assert "passed" not in done.stdout


def test_a_source_tree_uses_its_own_kernels(tmp_path: Path) -> None:
    """Whatever clrt is installed."""
    for folder in ("clrt", "kernels"):
        shutil.copytree(HOUSE / folder, tmp_path / folder)
    code = "from clrt.device.programs.kernel_files import kernel_folder; print(kernel_folder())"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()) == tmp_path / "kernels"
