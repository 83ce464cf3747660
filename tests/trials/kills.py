"""kill -9 at 100 random moments, then --resume: film, samples and estimate are equal bit for bit."""

from __future__ import annotations

import random
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from ..cli.test_checkpoints import arrays
from .renders import ALL_THE_TIME, CORNELL, await_rendering, finish, start

KILLS = 100
#: Adaptive sampling takes longer for the same number, in rounds of some tiles each.
MODES = {"even": ("--spp", 320), "adaptive": ("--spp", 192, "--adaptive")}


def trial() -> Iterator[str]:
    moments, met = random.Random(11), Counter[str]()
    whole = {mode: left_alone(mode) for mode in MODES}
    for number in range(KILLS):
        mode = list(MODES)[number % 2]
        expected, seconds = whole[mode]
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            process = render(folder, mode)
            await_rendering(process)
            time.sleep(moments.uniform(0, seconds))
            met["alive"] += process.poll() is None
            process.kill()
            process.communicate()
            met["with a checkpoint"] += (folder / "a.ck").exists()
            met["half written"] += (folder / "a.ck.new").exists()
            met["the older alone"] += (folder / "a.ck~").exists() and not (folder / "a.ck").exists()
            finish(render(folder, mode))
            met["equal"] += arrays(folder / "a.ck") == expected
    yield f"{met['equal']} of {KILLS} equal; when killed: " + ", ".join(
        f"{count} {what}" for what, count in met.items() if what != "equal"
    )


def render(folder: Path, mode: str) -> subprocess.Popen[str]:
    return start(
        folder,
        CORNELL,
        "--size",
        "64x64",
        "--checkpoint",
        "a.ck",
        "--resume",
        "--checkpoint-every",
        0,
        "-o",
        "a.exr",
        "--progress",
        "json",
        *MODES[mode],
        program=ALL_THE_TIME,
    )


def left_alone(mode: str) -> tuple[dict[str, bytes], float]:
    """Return the final checkpoint of an undisturbed render, and the seconds that it rendered."""
    with tempfile.TemporaryDirectory() as name:
        process = render(Path(name), mode)
        await_rendering(process)
        clock = time.perf_counter()
        finish(process)
        return arrays(Path(name) / "a.ck"), time.perf_counter() - clock
