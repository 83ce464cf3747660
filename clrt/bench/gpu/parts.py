"""The parts of the measurement, in the order in which they run: what is cheap and tells most comes first."""

from __future__ import annotations

from typing import NamedTuple

from . import builds, calls, compiles, facts, frames, gallery, hits, peers, ray_rates
from .request import Items


class Part(NamedTuple):
    """A part. share: its share of the time, relative to the others'; what it leaves falls to those after it."""

    title: str
    share: float
    items: Items


PARTS = {
    "device": Part("Device", 20, facts.items),
    "hits": Part("Hits", 14, hits.items),
    "images": Part("Images", 16, gallery.image_items),
    "rays": Part("Rays", 10, ray_rates.layout_items),
    "samples": Part("Samples", 40, gallery.speed_items),
    "groups": Part("Work-group sizes", 14, ray_rates.group_items),
    "builds": Part("BVH builds", 24, builds.items),
    "frames": Part("Frames", 12, frames.items),
    "calls": Part("Calls from Python", 2, calls.items),
    "compiles": Part("Compile times", 16, compiles.items),
    "peers": Part("Other renderers and libraries", 6, peers.items),
}
