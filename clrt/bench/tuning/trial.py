"""Trial of candidates on a device, in bounded launches: `python -m clrt.bench.tuning.trial ID` is a child process.

It reads the candidates from standard input, and prints every measurement at once, a JSON object per line: a candidate,
and its seconds per sample by scene. The candidates take turns, as other programs may use the device, too.
"""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import asdict, replace

from ...device.device_info import Tuning
from ...device.open import Device, open_device
from ...rendering.accumulation.accumulation import Accumulation
from ...rendering.renderer import Renderer
from .trial_scenes import trial_scenes

#: Side of the images in pixels by device type.
SIDES = {"cpu": 192, "simulator": 8}
SIDE = 768
#: Turns of each candidate, and the seconds of one per scene. The first, in which launches grow to their full size,
#: takes as long as all others.
TURNS, SECONDS = 5, 0.02


class Run:
    """A candidate on a device, ready to render the scenes."""

    def __init__(self, device: Device, candidate: Tuning) -> None:
        self.candidate = candidate
        tuned = replace(device, info=replace(device.info, tuning=candidate))
        scenes = trial_scenes(SIDES.get(device.info.type, SIDE))
        self._sessions = {name: Renderer(scene, device=tuned, spp=1).session for name, scene in scenes.items()}

    def measure(self, seconds: float) -> str:
        """Render each scene for some seconds; return the line to print."""
        took = {name: _seconds_a_sample(session, seconds) for name, session in self._sessions.items()}
        return json.dumps({"tuning": asdict(self.candidate), "seconds": took})


def _seconds_a_sample(session: Accumulation, seconds: float) -> float:
    (width, height), before, start = session.size, session.samples_done, time.perf_counter()
    while (took := time.perf_counter() - start) < seconds:
        for _ in session.render(session.pass_limit()):
            pass
        session.wait()
    return took / ((session.samples_done - before) * width * height)


def main() -> None:
    """Measure the candidates on standard input. What the driver prints goes to standard error."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as result:
        os.dup2(2, 1)
        device, runs = open_device(sys.argv[1]), []
        for fields in json.load(sys.stdin):
            runs.append(Run(device, Tuning(**fields)))
            print(runs[-1].measure((TURNS - 1) * SECONDS), file=result, flush=True)
        for run in (run for _ in range(TURNS - 1) for run in runs):
            print(run.measure(SECONDS), file=result, flush=True)


if __name__ == "__main__":
    main()
