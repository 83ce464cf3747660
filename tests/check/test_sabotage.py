"""Each broken kernel is detected by the part of the check that covers it."""

from __future__ import annotations

from pathlib import Path

import pytest

from clrt.check.check_parts import PARTS
from clrt.check.findings import Findings
from clrt.device.open import Device, open_device
from clrt.device.programs import program

from ..covering import others
from .sabotage import sabotaged

#: The part that must detect it, the replaced pattern in the kernels, its replacement, and a line before the file.
SABOTAGES = {
    "roots left out": ("arithmetic", r"\bsqrt\(", "("),
    "an fma that rounds twice": (
        "arithmetic",
        r"\bfma\(",
        "TWICE(",
        "#define TWICE(a, b, c) (fma(a, b, (c) * 0.0f) + (c))",
    ),
    "a minimum that keeps NaN": ("comparisons", r"return a < b \? a : b;", "return b < a ? b : a;"),
    "one bit too many": ("integers", r"\bpopcount\(", "1 + popcount("),
    "conversion that truncates": (
        "integers",
        r"PASTE\(convert_float, LANES\)",
        "PASTE(PASTE(convert_float, LANES), _rtz)",
    ),
    "the lane before": ("masks", r"popcount\(~bits & \(bits - 1\)\)", "popcount(~bits & (bits - 1)) - 1"),
    "an atomic that is none": ("memory", r"\batomic_max\(", "SET(", "#define SET(place, value) (*(place) = (value))"),
    "another hash": ("random numbers", r"1664525u", "1664527u"),
    "sums without their errors": ("sums", r"real s = \*sum \+ x;[^}]*", "*sum += x;"),
    "boxes inside out": ("rays", r"t_near <= t_far", "t_near > t_far"),
    "cracks between triangles": ("rays", r"e->u1 >= e->u2\)(.*)e->u1 <= e->u2\)", r"e->u1 > e->u2)\1e->u1 < e->u2)"),
    "the far child forgotten": ("binary tree", r"distance\[top\+\+\] = far;", ""),
    "boxes too small": ("tree builder", r"box_union\(Box a, Box b\) \{", r"\g<0>\n    b = a;"),
    "paint that swallows light": (
        "furnace",
        r"sample.weight = (m->color);",
        r"sample.weight = scale(\1, (real)(0.999999f));",
    ),
    "light that does not fade": ("lamp", r"inverse \* inverse", "inverse"),
    "balls that light themselves": (
        "ball",
        r"best_cosine\(dot3\(n, d\), distance, r\)",
        "best_cosine(dot3(n, d), distance, 1.0001f * r)",
    ),
    "weights that sum to two": ("room", r"return 1.0f / \(1.0f \+ ratio \* ratio\);", "return ONE;"),
    "a density off by a tenth": ("room", r"return t \* t / \(absolute", "return 1.1f * t * t / (absolute"),
}


@pytest.fixture(scope="module")
def best() -> Device:
    """Return the default device."""
    return open_device()


#: Parts with BVHs or images, which take long to compile.
LARGE = ("binary tree", "tree builder", "furnace", "lamp", "ball", "room")
SMALL = [name for name, (part, *_) in SABOTAGES.items() if part not in LARGE]


@pytest.mark.programs
@pytest.mark.parametrize("name", SMALL + others(*(name for name in SABOTAGES if name not in SMALL)))
def test_what_is_broken_is_found(best: Device, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part, *edit = SABOTAGES[name]
    folder = sabotaged(tmp_path / "kernels", *edit)
    monkeypatch.setattr(program, "kernel_folder", lambda: folder)
    findings = Findings()
    PARTS[part](best, findings)
    assert findings.failures, f"{name} is not found by {part}"
