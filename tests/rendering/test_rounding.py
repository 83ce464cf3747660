"""Rounding that compilers may choose changes almost no path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clrt.bench.numerics.cases.devices import ROUNDING, everything
from clrt.bench.numerics.cases.subject import Subject
from clrt.device.open import Device
from clrt.device.programs import program

from ..check.sabotage import sabotaged


@pytest.mark.statistics
def test_products_that_are_rounded_before_they_are_added(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compilers may contract a·b + c to one fused operation. About two of 10 000 paths diverge by that."""
    scene, subject = everything((48, 48)), Subject(device.info.index)
    contracted = subject.picture(scene, 4)
    folder = sabotaged(tmp_path / "kernels", r"\A", "", head="#pragma OPENCL FP_CONTRACT OFF")
    monkeypatch.setattr(program, "kernel_folder", lambda: folder)
    plain = subject.picture(scene, 4)
    elsewhere = np.abs(plain - contracted).max(axis=2) > ROUNDING * (contracted.max(axis=2) + 1e-3)
    assert np.array_equal(plain, contracted) == (not device.fuses)
    assert np.mean(elsewhere) < 0.003
