"""Ids of names in Cryptomatte layers (Friedman and Jones 2015, "Fully Automatic ID Mattes with Support for Motion Blur
and Transparency"; Psyop's specification 1.2.0)."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .model import Scene
from .numbered_objects import material_names, object_names

#: AOVs that are Cryptomatte layers, and the names that they are of, by number.
NAMES = {"crypto_object": object_names, "crypto_material": material_names}
#: Pairs of id and coverage per pixel, two per layer.
RANKS = 6


def manifest_of(scene: Scene, aov: str) -> dict[str, str]:
    """Return the ids of all names as hexadecimal numbers."""
    return {name: f"{id_of(name):08x}" for name in NAMES[aov](scene)}


def ids_of(names: Sequence[str]) -> NDArray[np.float32]:
    """Return the ids by number, as the floats that stand for them."""
    return np.array([id_of(name) for name in names], np.uint32).view(np.float32)


def id_of(name: str) -> int:
    """Return the hash of a name, with an exponent that makes it a normal float."""
    found = murmur3(name.encode())
    return found ^ 1 << 23 if found >> 23 & 255 in (0, 255) else found


def header_entries(aov: str, manifest: dict[str, str]) -> dict[str, str]:
    """Return the entries of a file's header that describe a layer."""
    key = f"cryptomatte/{murmur3(aov.encode()):08x}"[: len("cryptomatte/") + 7]
    text = json.dumps(manifest, separators=(",", ":"))
    return {
        f"{key}/name": aov,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": text,
    }


def murmur3(data: bytes) -> int:
    """Return the 32-bit MurmurHash3 (x86_32, seed 0; Appleby 2011)."""
    whole = len(data) // 4
    state = 0
    for word in struct.unpack(f"<{whole}I", data[: 4 * whole]):
        state = (_rotated(state ^ _mixed(word), 13) * 5 + 0xE6546B64) & 0xFFFFFFFF
    state ^= _mixed(int.from_bytes(data[4 * whole :], "little")) ^ len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        state = (state ^ state >> shift) * factor & 0xFFFFFFFF
    return state ^ state >> 16


def _mixed(word: int) -> int:
    return _rotated(word * 0xCC9E2D51 & 0xFFFFFFFF, 15) * 0x1B873593 & 0xFFFFFFFF


def _rotated(word: int, count: int) -> int:
    return (word << count | word >> 32 - count) & 0xFFFFFFFF
