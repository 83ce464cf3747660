"""Saved state of a render, and its conversion to and from arrays for a file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..accumulation.work_queue import WorkPart, WorkQueue
from ..compile.film_record import PARTS, pixel_record
from ..compile.records import PIXEL
from ..error_estimate.error_estimate import NoiseEstimate
from ..film.film import Film
from ..film.tiles import tiles_of
from .checkpoint_file import Arrays

#: Columns of a history, NaN for values that an entry lacks.
HISTORY = ("spp", "seconds", "noise", "relmse")
#: Arrays of the film's records, by their features.
FILM_PARTS = {feature: feature.lower() for feature in PARTS}
KINDS: dict[str, np.dtype[Any]] = {
    "film": PIXEL,
    **{name: PARTS[feature] for feature, name in FILM_PARTS.items()},
    "groups": np.dtype(np.float32),
    "samples": np.dtype(np.int64),
    "then": np.dtype(np.int64),
    "tiles": np.dtype(np.uint32),
    "parts": np.dtype(np.int64),
    "noise_mean": np.dtype(np.float32),
    "noise_changes": np.dtype(np.float64),
    "noise_level": np.dtype(np.int64),
    "history": np.dtype(np.float64),
}
MOST_SAMPLES = 1 << 32
NO_SENSE = "is damaged: its parts are inconsistent"


@dataclass(frozen=True)
class SavedState:
    """Saved state of a render between two launches. planned_spp: the sampler's planned samples (session.block_bits)."""

    planned_spp: int | None
    seconds: float
    history: list[dict[str, Any]]
    film: Film
    work: WorkQueue
    noise: NoiseEstimate


def to_arrays(kept: SavedState) -> Arrays:
    """Return arrays as in KINDS. parts: (k, 4); history: (n, 4), see HISTORY; others: see Work and NoiseEstimate."""
    work, (mean, changes, level) = kept.work, kept.noise.arrays()
    rows = [[np.nan if entry.get(name) is None else entry[name] for name in HISTORY] for entry in kept.history]
    arrays = {
        **_film_parts(kept.film),
        "samples": work.samples,
        "then": work.then,
        "tiles": work.tiles,
        "parts": np.array(work.parts).reshape(-1, 4),
        "noise_mean": mean,
        "noise_changes": changes,
        "noise_level": level,
        "history": np.array(rows).reshape(-1, 4),
    }
    return {name: arrays[name].astype(kind, copy=False) for name, kind in KINDS.items()}


def from_arrays(
    header: dict[str, Any], arrays: Arrays, size: tuple[int, int], features: Collection[str], groups: int
) -> SavedState:
    """Return the saved state of an image of (width, height), whose film stores what these features require, and this
    many light groups. Raises ValueError if the parts are inconsistent."""
    planned, seconds = header.get("planned_spp"), header.get("seconds")
    if (
        not (planned is None or type(planned) is int and planned > 0)
        or type(seconds) is not float
        or not (
            0 <= seconds < np.inf
            and _film_fits(arrays, size, features, groups)
            and _work_fits(arrays, size)
            and _noise_fits(arrays, size)
        )
    ):
        raise ValueError(NO_SENSE)
    work = WorkQueue(arrays["samples"], arrays["then"], arrays["tiles"], map(WorkPart._make, arrays["parts"].tolist()))
    noise = NoiseEstimate(planned)
    film = np.empty(arrays["film"].shape, pixel_record(features, groups))
    for part in ("film", *(name for feature, name in FILM_PARTS.items() if feature in features)):
        for name in arrays[part].dtype.names or ():
            film[name] = arrays[part][name]
    if groups:
        film["groups"] = arrays["groups"].reshape(*film.shape, groups, 2, 3)
    noise.restore(arrays["noise_mean"], arrays["noise_changes"], arrays["noise_level"])
    history = []
    for spp, second, error, relmse in arrays["history"].tolist():
        entry = {"spp": int(spp), "seconds": second, "noise": None if np.isnan(error) else error}
        history.append(entry if np.isnan(relmse) else {**entry, "relmse": relmse})
    return SavedState(planned, seconds, history, Film(film), work, noise)


def _film_parts(film: Film) -> Arrays:
    """Return its records one by one, empty if the film does not have them."""
    parts = {"film": film.pixels[list(PIXEL.names or ())]}
    for feature, name in FILM_PARTS.items():
        fields = list(PARTS[feature].names or ())
        has = set(fields) <= set(film.pixels.dtype.names or ())
        parts[name] = film.pixels[fields] if has else np.zeros((0, 0), PARTS[feature])
    groups = film.pixels["groups"] if film.has_groups else np.zeros((0, 0, 0))
    return {**parts, "groups": groups.reshape(*groups.shape[:2], -1) if groups.size else groups}


def _film_fits(arrays: Arrays, size: tuple[int, int], features: Collection[str], groups: int) -> bool:
    """Return whether the film has this size, and exactly the records that these features and light groups require."""
    wanted: dict[str, tuple[int, ...]] = {
        name: size[::-1] if feature in features else (0, 0) for feature, name in FILM_PARTS.items()
    }
    wanted["groups"] = (*size[::-1], 6 * groups) if groups else (0, 0, 0)
    return bool(
        arrays["film"].shape == size[::-1] and all(arrays[name].shape == shape for name, shape in wanted.items())
    )


def _work_fits(arrays: Arrays, size: tuple[int, int]) -> bool:
    """Return whether the work has this size, and no launch would exceed the film or 2³² samples."""
    samples, then, tiles, parts = (arrays[name] for name in ("samples", "then", "tiles", "parts"))
    return bool(
        samples.shape == then.shape == tiles_of(size)
        and np.all((0 <= samples) & (samples <= then) & (then <= MOST_SAMPLES))
        and tiles.ndim == 1
        and np.all(tiles < samples.size)
        and parts.shape[1:] == (4,)
        and all(
            0 <= part.first < part.end <= len(tiles)
            and 0 <= part.samples < MOST_SAMPLES
            and 0 < part.more <= MOST_SAMPLES - part.samples
            for part in map(WorkPart._make, parts.tolist())
        )
    )


def _noise_fits(arrays: Arrays, size: tuple[int, int]) -> bool:
    """Return whether estimate and history have this size; there is no estimate before the first image."""
    mean, changes, level = (arrays[name] for name in ("noise_mean", "noise_changes", "noise_level"))
    shapes = [(*size[::-1], 3), tiles_of(size)] if mean.size else [(0, 0, 3), (0, 0)]
    history = arrays["history"]
    return bool(
        [mean.shape, level.shape] == shapes
        and changes.shape[1:] == (2, *level.shape)
        and len(changes) <= 64
        and np.all((-1 <= level) & (level <= len(changes)))
        and history.shape[1:] == (4,)
        and np.all(np.isfinite(history[:, :2]))
    )
