"""Rays and visits of recorded work-items, as arrays.

A turn is an iteration of the outer loop of a ray's traversal: one node, or one leaf of bvh2, and
the primitives tested after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .record import Record

Ints = NDArray[np.int64]

#: Kinds of words, in the order of the enum in kernels/traverse/visits.cl.
KINDS = ("nodes", "leaves", "tests", "spheres", "instances", "closest", "blocked", "segments", "shading")
NODES, LEAVES, TESTS, SPHERES, INSTANCES, CLOSEST, BLOCKED, SEGMENTS, SHADING = range(len(KINDS))
#: Bits of a word that hold the index.
INDEX_BITS = 28
#: Stages of a path segment: its own rays, and those to a light.
EXTEND, CONNECT = 0, 1


@dataclass(frozen=True)
class Visits:
    """What rays visited. Rays are in the order of their paths; without paths, each ray is one of a single segment.

    - path, segment, stage, number (rays,): number counts the rays of a stage, of which there are several where
      surfaces let light pass; blocked: whether the ray asks for any hit
    - ray, turn, place, kind, index (visits,): place counts the visits of a kind in a turn
    - shaded_path, shaded_segment, material (surfaces,): evaluations of materials, by the code type | index << 4
    """

    paths: int
    path: Ints
    segment: Ints
    stage: Ints
    number: Ints
    blocked: NDArray[np.bool_]
    ray: Ints
    turn: Ints
    place: Ints
    kind: Ints
    index: Ints
    shaded_path: Ints
    shaded_segment: Ints
    material: Ints

    @property
    def rays(self) -> int:
        """Return the number of rays."""
        return len(self.path)

    @property
    def turns(self) -> Ints:
        """Return the number of turns of each ray, (rays,)."""
        turns = np.zeros(self.rays, np.int64)
        np.maximum.at(turns, self.ray, self.turn + 1)
        return turns


def visits_of(record: Record) -> Visits:
    """Return the visits of a record."""
    kind, index = record.words.astype(np.int64) >> INDEX_BITS, record.words.astype(np.int64) & ((1 << INDEX_BITS) - 1)
    item = np.repeat(np.arange(len(record.counts)), record.counts)
    starts, shades, begins = (kind == CLOSEST) | (kind == BLOCKED), kind == SHADING, kind == SEGMENTS
    ray, seen = np.cumsum(starts) - 1, kind <= INSTANCES
    # Words of a path without any segment are those of rays alone.
    if begins.any():
        path, segment = item[starts], index[begins][np.cumsum(begins)[starts] - 1] - 1
        shaded = np.cumsum(shades)
        before = shaded[begins][np.cumsum(begins)[starts] - 1]
        stage = np.where(shaded[starts] > before, CONNECT, EXTEND)
        paths = len(record.counts)
    else:
        path, paths = np.arange(np.count_nonzero(starts)), int(np.count_nonzero(starts))
        segment = stage = np.zeros(paths, np.int64)
    of_ray = ray[seen]
    heads = (kind[seen] == NODES) | (kind[seen] == LEAVES)
    headed = np.cumsum(heads)
    first = np.searchsorted(of_ray, of_ray)
    turn = headed - headed[first] + heads[first] - 1
    return Visits(
        paths,
        path,
        segment,
        stage,
        rank(label(path, segment, stage)),
        kind[starts] == BLOCKED,
        of_ray,
        turn,
        rank(label(of_ray, turn, kind[seen])),
        kind[seen],
        index[seen],
        item[shades],
        index[begins][np.cumsum(begins)[shades] - 1] - 1 if begins.any() else item[shades],
        index[shades],
    )


def label(*columns: Ints) -> Ints:
    """Return a number for each row of these columns of numbers from 0 on, in their lexical order."""
    labels = np.zeros(len(columns[0]), np.int64)
    for column in columns:
        labels = labels * (int(column.max(initial=0)) + 1) + column
    return labels


def dense(labels: Ints) -> Ints:
    """Return the labels numbered from 0 without gaps, in the same order."""
    return np.asarray(np.unique(labels, return_inverse=True)[1], np.int64)


def rank(labels: Ints) -> Ints:
    """Return how many equal labels come before each."""
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    ranks = np.empty(len(labels), np.int64)
    ranks[order] = np.arange(len(labels)) - np.searchsorted(ordered, ordered)
    return ranks
