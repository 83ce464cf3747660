"""`python -m tests.oracle --scenes 200`: the renderer against the oracle on random scenes."""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from clrt.device.open import open_device

from .compare import verdict
from .scenes import random_scene, todays_seed


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.oracle", description=__doc__)
    parser.add_argument("--scenes", type=int, default=200, metavar="N", help="how many; default: 200")
    parser.add_argument("--first", type=int, default=0, metavar="I", help="number of the first one; default: 0")
    parser.add_argument("--seed", type=int, default=todays_seed(), metavar="S", help="default: today's date")
    parser.add_argument("--device", help="see `clrt devices`")
    given = parser.parse_args()
    device, start, found = open_device(given.device), time.perf_counter(), []
    print(f"seed {given.seed}", flush=True)
    for number in range(given.first, given.first + given.scenes):
        found.append(verdict(device, random_scene(given.seed, number), given.seed))
        print(found[-1], "  OFF" if found[-1].is_off(given.scenes) else "", flush=True)
    off = [each for each in found if each.is_off(given.scenes)]
    weights = np.array([1 / max(each.error, 1e-4) ** 2 for each in found])
    ratio = np.average([each.ratio for each in found], weights=weights)
    print(
        f"{len(off)} of {len(found)} random scenes off; mean {ratio:.5f} ± {weights.sum() ** -0.5:.5f} of the oracle's;"
        f" {time.perf_counter() - start:.0f} s"
    )
    return bool(off)


sys.exit(main())
