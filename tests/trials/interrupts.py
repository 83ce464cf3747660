"""Interrupts a render at 20 random moments: time until image and checkpoint are written and the process ends."""

from __future__ import annotations

import random
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from clrt.output.images import read_image
from clrt.rendering.checkpoint.checkpoint_file import read_checkpoint
from clrt.rendering.checkpoint.saved_state import KINDS

from .renders import CORNELL, await_rendering, start

TIMES = 20
SIZES = ((512, 512), (1920, 1080))


def trial() -> Iterator[str]:
    moments = random.Random(5)
    for size in SIZES:
        rows = [interrupted(size, moments.uniform(0, 2.5)) for _ in range(TIMES)]
        for what, seconds in zip(("written", "ended"), zip(*rows)):
            yield (
                f"{size[0]}x{size[1]} {what} after {median(seconds):.2f} s (median), {max(seconds):.2f} s at most; "
                f"all {TIMES} pictures and checkpoints valid"
            )


def interrupted(size: tuple[int, int], moment: float) -> tuple[float, float]:
    """Return the seconds until both files were in place, and until the process had ended."""
    width, height = size
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        process = start(
            folder,
            CORNELL,
            "--size",
            f"{width}x{height}",
            "--time",
            600,
            "--checkpoint",
            "a.ck",
            "-o",
            "a.png",
            "--progress",
            "json",
        )
        await_rendering(process)
        time.sleep(moment)
        begin, clock = time.time(), time.perf_counter()
        process.send_signal(signal.SIGINT)
        while process.poll() is None:
            time.sleep(0.001)
        ended = time.perf_counter() - clock
        _, messages = process.communicate()
        assert process.returncode == 130, messages
        assert read_image(folder / "a.png").shape == (height, width, 3)
        assert read_checkpoint(folder / "a.ck", KINDS)[1]["film"].shape == (height, width)
        return max((folder / file).stat().st_ctime for file in ("a.png", "a.ck")) - begin, ended
