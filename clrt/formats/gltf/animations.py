"""Animations of a glTF file: node properties at a time (specification 3.11, appendix C)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from . import schema as gltf
from .accessors import GltfData, normalised

Doubles = NDArray[np.float64]
#: Animated properties of a node, with the accessor type of their values.
PROPERTIES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
#: Values per keyframe: the value, in CUBICSPLINE between its tangents.
PARTS = {"LINEAR": 1, "STEP": 1, "CUBICSPLINE": 3}
#: Quaternions this close are interpolated linearly; the sine of their angle has few digits.
CLOSE = 1e-6


class Track(NamedTuple):
    """Keyframes of one property. times: (k,), ascending; values: (k, PARTS, n)."""

    node: int
    property: str
    interpolation: str
    times: NDArray[np.floating]
    values: NDArray[np.floating]

    def at(self, time: float) -> Doubles:
        """Return the value (n,) at a time; before the first keyframe and after the last one, theirs."""
        first = int(np.clip(np.searchsorted(self.times, time, "right") - 1, 0, len(self.times) - 1))
        rows = self.values[first : first + 2].astype(np.float64)
        middle = rows.shape[1] // 2
        if time <= self.times[first] or len(rows) == 1 or self.interpolation == "STEP":
            return np.asarray(rows[0, middle])
        start, end = self.times[first : first + 2].astype(np.float64)
        span, s = end - start, (time - start) / (end - start)
        if self.interpolation == "CUBICSPLINE":
            (_, value, leaving), (arriving, following, _) = rows
            return np.asarray(
                (2 * s**3 - 3 * s**2 + 1) * value
                + span * (s**3 - 2 * s**2 + s) * leaving
                + (3 * s**2 - 2 * s**3) * following
                + span * (s**3 - s**2) * arriving
            )
        if self.property == "rotation":
            return slerp(rows[0, 0], rows[1, 0], s)
        return np.asarray((1 - s) * rows[0, 0] + s * rows[1, 0])


def slerp(one: Doubles, other: Doubles, s: float) -> Doubles:
    """Return the rotation a fraction `s` of the shorter way from one quaternion, of any length, to another."""
    one, other = one / np.linalg.norm(one), other / np.linalg.norm(other)
    other = -other if one @ other < 0 else other
    angle = 2 * np.arctan2(np.linalg.norm(one - other), np.linalg.norm(one + other))
    if angle < CLOSE:
        return np.asarray((1 - s) * one + s * other)
    return np.asarray((np.sin((1 - s) * angle) * one + np.sin(s * angle) * other) / np.sin(angle))


class Clip:
    """One of a document's animations. ignored: what of it is not supported."""

    def __init__(self, data: GltfData, index: int) -> None:
        document = data.document
        source = document.animations[index]
        name = f'animation "{animation_names(document)[index]}"'
        self.ignored: list[str] = []
        self._tracks: list[Track] = []
        for channel in source.channels:
            target = channel.target
            if target.node is None or target.path not in PROPERTIES:
                self.ignored += [] if target.path in PROPERTIES else [f'"{target.path}" of {name}']
                continue
            sampler = gltf.entry(source.samplers, channel.sampler, "sampler", name)
            track = _track(data, target.node, target.path, sampler, f"{name}, {target.path} of node {target.node}")
            if gltf.entry(document.nodes, target.node, "node", name).matrix and target.path != "weights":
                self.ignored.append(f"{target.path} of node {target.node}, which has a matrix, in {name}")
            else:
                self._tracks.append(track)

    @property
    def seconds(self) -> float:
        """The time of the last keyframe; 0 without any."""
        return max((float(track.times[-1]) for track in self._tracks), default=0.0)

    def posed(self, nodes: Sequence[gltf.Node], time: float) -> list[gltf.Node]:
        """Return the document's nodes with their properties at a time in seconds."""
        changed: dict[int, dict[str, list[float]]] = {}
        for track in self._tracks:
            changed.setdefault(track.node, {})[track.property] = track.at(time).tolist()
        return [
            node.model_copy(update=changed[index]) if index in changed else node for index, node in enumerate(nodes)
        ]


def animation_names(document: gltf.Document) -> list[str]:
    """Return a unique name for each animation."""
    return gltf.unique_names("animation", [animation.name for animation in document.animations])


def _track(data: GltfData, node: int, path: str, sampler: gltf.AnimationSampler, user: str) -> Track:
    """Return the keyframes of a channel. Raises SceneError for times that do not ascend, other numbers of values, and
    values that are not finite."""
    kind = str(sampler.interpolation)
    parts = PARTS.get(kind)
    if parts is None:
        raise SceneError(f'{user}: its interpolation is "{kind}"; write one of {", ".join(PARTS)}')
    times = data.array(sampler.input, "SCALAR", user)[:, 0]
    values = data.array(sampler.output, PROPERTIES[path], user)
    if path in ("rotation", "weights"):
        values = normalised(values)
    count = parts * len(times)
    if len(values) % count or (path != "weights" and len(values) != count):
        raise SceneError(f"{user}: has {len(values)} values for {len(times)} times; export it again")
    if not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise SceneError(f"{user}: its times do not ascend; export it again")
    values = values.reshape(len(times), parts, -1)
    if not np.isfinite(values).all():
        raise SceneError(f"{user}: has a value that is not finite; export it again")
    if path == "rotation" and not values[:, parts // 2].any(axis=1).all():
        raise SceneError(f"{user}: has a rotation [0, 0, 0, 0]; write [0, 0, 0, 1] for none")
    return Track(node, path, kind, times, values)
