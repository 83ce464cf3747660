"""Animations of a glTF file: node properties at a time (specification 3.11, appendix C)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from . import schema as gltf
from .accessors import GltfData, normalised
from .pointers import NODE, kind_of, with_value

Doubles = NDArray[np.float64]
#: Animated properties of a node, with the accessor type of their values.
PROPERTIES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
#: Values per keyframe: the value, in CUBICSPLINE between its tangents.
PARTS = {"LINEAR": 1, "STEP": 1, "CUBICSPLINE": 3}
#: Quaternions this close are interpolated linearly; the sine of their angle has few digits.
CLOSE = 1e-6


class Track(NamedTuple):
    """Keyframes of one property, of a node or named by a pointer. times: (k,), ascending; values: (k, PARTS, n)."""

    node: int | None
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
        source = gltf.parse_animation(document, index)
        name = f'animation "{animation_names(document)[index]}"'
        self.ignored: list[str] = []
        self._tracks: list[Track] = []
        for channel in source.channels:
            sampler = gltf.entry(source.samplers, channel.sampler, "sampler", name)
            node, path = _target(channel.target)
            if node is None and path in PROPERTIES:
                continue
            kind = (PROPERTIES[path], 0) if node is not None and path in PROPERTIES else kind_of(document, path)
            if kind is None:
                self.ignored.append(f'"{path}" of {name}')
                continue
            user = f"{name}, {path}" if node is None else f"{name}, {path} of node {node}"
            track = _track(data, node, path, kind, sampler, user)
            if node is not None and gltf.entry(document.nodes, node, "node", name).matrix and path != "weights":
                self.ignored.append(f"{path} of node {node}, which has a matrix, in {name}")
            else:
                self._tracks.append(track)

    @property
    def changes_materials(self) -> bool:
        """Whether it animates materials."""
        return any(track.property.startswith("/materials/") for track in self._tracks)

    @property
    def seconds(self) -> float:
        """The time of the last keyframe; 0 without any."""
        return max((float(track.times[-1]) for track in self._tracks), default=0.0)

    def posed(self, document: gltf.Document, time: float) -> gltf.Document:
        """Return the document with its properties at a time in seconds."""
        changed: dict[int, dict[str, list[float]]] = {}
        for track in self._tracks:
            if track.node is None:
                document = with_value(document, track.property, track.at(time))
            else:
                changed.setdefault(track.node, {})[track.property] = track.at(time).tolist()
        nodes = [
            node.model_copy(update=changed[index]) if index in changed else node
            for index, node in enumerate(document.nodes)
        ]
        return document.model_copy(update={"nodes": nodes})


def animation_names(document: gltf.Document) -> list[str]:
    """Return a unique name for each animation."""
    names = [animation.get("name") for animation in document.animations]
    return gltf.unique_names("animation", [name if isinstance(name, str) else None for name in names])


def _target(target: gltf.AnimationTarget) -> tuple[int | None, str]:
    """Return the node and the property of a channel, or None and the pointer to another property."""
    pointer = target.extensions.KHR_animation_pointer
    if target.path != "pointer" or pointer is None:
        return target.node, target.path
    match = NODE.fullmatch(pointer.pointer)
    return (int(match[1]), match[2]) if match else (None, pointer.pointer)


def _track(
    data: GltfData,
    node: int | None,
    path: str,
    kind: tuple[str, int],
    sampler: gltf.AnimationSampler,
    user: str,
) -> Track:
    """Return the keyframes of a channel. kind: see `kind_of`; any number of weights. Raises SceneError for times that
    do not ascend, other numbers of values, and values that are not finite."""
    accessor, size = kind
    interpolation = str(sampler.interpolation)
    parts = PARTS.get(interpolation)
    if parts is None:
        raise SceneError(f'{user}: its interpolation is "{interpolation}"; write one of {", ".join(PARTS)}')
    times = data.array(sampler.input, "SCALAR", user)[:, 0]
    values = data.array(sampler.output, accessor, user)
    if path in ("rotation", "weights"):
        values = normalised(values)
    count = parts * len(times)
    if len(values) % count or (path != "weights" and len(values) != count * max(size, 1)):
        raise SceneError(f"{user}: has {len(values)} values for {len(times)} times; export it again")
    if not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise SceneError(f"{user}: its times do not ascend; export it again")
    values = values.reshape(len(times), parts, -1)
    if not np.isfinite(values).all():
        raise SceneError(f"{user}: has a value that is not finite; export it again")
    if path == "rotation" and not values[:, parts // 2].any(axis=1).all():
        raise SceneError(f"{user}: has a rotation [0, 0, 0, 0]; write [0, 0, 0, 1] for none")
    return Track(node, path, interpolation, times, values)
