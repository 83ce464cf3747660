"""Writes docs/programs.md, what is compiled for each scene of scenes/: python docs/make_programs.py"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Of every scene, or said by its files already.
EVERYWHERE = {"PRIMITIVES", "IN_TREE", "TRIANGLES", "SPHERES", "LIGHTS"}

TEXT = """# What is compiled for each scene

The program of a scene contains what that scene uses and nothing else. `clrt info SCENE` lists its features and files,
and `clrt render SCENE --print-kernel` prints it. For the scenes of this repository, in waves for CPUs (`python
docs/make_programs.py` wrote this):

| scene | kB of text | files | features |
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
