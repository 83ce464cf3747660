"""Alias tables: a choice with given probabilities in constant time (Walker 1977)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def alias_table(weights: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float64]]:
    """(threshold, alias, probability), each (n,), for `weights` (n,) >= 0 with a positive sum.

    Slot i, drawn uniformly, stands for itself below threshold[i] and for alias[i] above. Built by prefix sums instead
    of a loop (Lehmann, Hübschle-Schneider and Sanders 2021, "Weighted Random Sampling on GPUs"): light slots take
    what they lack from the heavy ones in order, and a heavy slot that has given away more than its excess is filled
    up by the next. Light slot i therefore meets the first heavy one whose running excess passes the running lack
    before i; heavy slot j ends at 1 + excess_j − lack at the first light slot whose running lack passes excess_j.
    """
    probability = weights / weights.sum()
    scaled = probability * len(weights)
    threshold = np.ones(len(weights))
    alias = np.arange(len(weights))
    light, heavy = np.flatnonzero(scaled < 1), np.flatnonzero(scaled >= 1)
    if light.size and heavy.size:
        lack = np.cumsum(1 - scaled[light])
        excess = np.cumsum(scaled[heavy] - 1)
        before = np.concatenate([[0.0], lack[:-1]])
        giver = np.minimum(np.searchsorted(excess, before, side="left"), heavy.size - 1)
        threshold[light] = scaled[light]
        alias[light] = heavy[giver]
        last = np.searchsorted(lack, excess[:-1], side="right")
        short = last < light.size
        threshold[heavy[:-1][short]] = 1 + excess[:-1][short] - lack[last[short]]
        alias[heavy[:-1][short]] = heavy[1:][short]
    return threshold.astype(np.float32), alias.astype(np.int32), probability
