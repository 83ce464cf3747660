"""`python -m tests.trials [NAME...]`: see the package."""

from __future__ import annotations

import signal
import sys
import time
from importlib import import_module

NAMES = (
    "launches",
    "interrupts",
    "kills",
    "damage",
    "errors",
    "calibration",
    "scaling",
    "drivers",
    "caches",
    "large_models",
    "horizon",
    "rough_glass",
    "agreement",
    "mitsuba_files",
    "sky",
)

# Renders that are started in the background of a shell would ignore the interrupts that trials send them.
signal.signal(signal.SIGINT, signal.default_int_handler)
for name in sys.argv[1:] or NAMES:
    if name not in NAMES:
        sys.exit(f"no trial {name!r}; there are {', '.join(NAMES)}")
    module = import_module(f".{name}", __package__)
    print(f"== {name}: {(module.__doc__ or '').splitlines()[0]}", flush=True)
    start = time.perf_counter()
    for line in module.trial():
        print(f"  {line}", flush=True)
    print(f"  ({time.perf_counter() - start:.0f} s)", flush=True)
