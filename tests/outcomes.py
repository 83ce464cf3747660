"""Renders the files in folders with `clrt render`: `python -m tests.outcomes FOLDER...` prints a table of outcomes.

Each file is rendered small in its own process. An image (outcome "picture", with its warnings) and an error with exit
code 3 are the expected outcomes.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from clrt.formats.models import SUFFIXES

#: Time limit per file in seconds.
LIMIT = 120


def outcome(file: Path, picture: Path) -> tuple[str, str]:
    """Return the outcome ("picture", "error", or a failure) and the messages without the file's path."""
    command = [sys.executable, "-m", "clrt", "render", str(file), "--size", "64x64", "--spp", "4", "-o", str(picture)]
    try:
        done = subprocess.run([*command, "--progress", "json"], capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return "hang", ""
    told = [json.loads(line).get("warning") if line.startswith("{") else line for line in done.stderr.splitlines()]
    said = [line.replace(f"{file}: ", "").removeprefix("error: ") for line in told if line]
    kinds = {0: "picture", 3: "error"}
    kind = "traceback" if "Traceback" in done.stderr else kinds.get(done.returncode, f"code {done.returncode}")
    return kind, "; ".join(said)


def main() -> None:
    files = sorted(file for folder in sys.argv[1:] for file in Path(folder).rglob("*") if file.suffix in SUFFIXES)
    counts: dict[str, int] = {}
    print("| file | outcome | said |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for file in files:
            kind, said = outcome(file, Path(folder) / "a.png")
            counts[kind] = counts.get(kind, 0) + 1
            print(f"| {file.name} | {kind} | {said.replace('|', '/')} |", flush=True)
    print(f"\n{len(files)} files: " + ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
