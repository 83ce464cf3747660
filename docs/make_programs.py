"""Generate docs/programs.md, the table of what is compiled for each scene of scenes/: python docs/make_programs.py"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Features that every scene has, or that the list of its files already shows.
EVERYWHERE = {"PRIMITIVES", "IN_TREE", "TRIANGLES", "SPHERES", "LIGHTS"}

TEXT = """# What is compiled for each scene

The OpenCL program of a scene contains only the code that the scene uses. `clrt info SCENE` lists its features and
source files, and `clrt render SCENE --print-kernel` prints its source. The table lists the scenes of this repository,
compiled as wavefront kernels for CPUs. `python docs/make_programs.py` generates this page.

| scene | source (kB) | source files | features |
|---|---|---|---|
"""


def facts(scene: Path) -> dict[str, object]:
    command = [sys.executable, "-m", "clrt", "info", scene, "--json", "--device", "cpu"]
    output = subprocess.run(command, check=True, capture_output=True)
    told: dict[str, object] = json.loads(output.stdout)
    return told


def main() -> None:
    rows = []
    for scene in sorted((ROOT / "scenes").glob("*.toml")):
        told = facts(scene)
        features = [name.lower() for name in told["features"] if name not in EVERYWHERE]  # type: ignore[attr-defined]
        size, files = int(str(told["kernel_bytes"])), len(told["files"])  # type: ignore[arg-type]
        rows.append((size, f"| `{scene.stem}` | {size / 1000:.0f} | {files} | {' '.join(features)} |\n"))
    text = TEXT + "".join(line for _, line in sorted(rows))
    (ROOT / "docs" / "programs.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
