"""Comparison of the poses of animated glTF files with those of other programs (`pose_peers`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import ClrtError, SceneError
from ...formats.gltf.accessors import GltfData
from ...formats.gltf.animations import animation_names
from ...formats.gltf.schema import parse_animation
from ...formats.model_choice import ModelChoice
from ...formats.models import read_model
from ...scene.geometry.instancing import baked
from .pose_peers import Doubles, Poser

#: Programs whose poses are the file's only at keyframes.
AT_KEYS = {"Blender"}


class Judged(NamedTuple):
    """Comparison of one animation with one program's, in units of the diagonal of the pose's bounding box.

    - points: the greatest distance from a vertex of either pose to the nearest one of the other
    - box: the greatest difference of a coordinate of the two bounding boxes
    - worst: the time of the former; poses, vertices: what was compared
    - problem: why there are no poses, if there are none
    """

    file: str
    animation: str = ""
    peer: str = ""
    poses: int = 0
    vertices: int = 0
    points: float = np.nan
    box: float = np.nan
    worst: float = np.nan
    problem: str = ""


def judge(file: Path, count: int, peers: Mapping[str, Poser]) -> Iterator[Judged]:
    """Compare `count` poses of each animation of a file with those of each program.

    Half of them are at keyframes, the others at random times, except with programs that interpolate otherwise.
    """
    try:
        data = GltfData(file)
    except SceneError as error:
        yield Judged(file.name, problem=error.problems[0])
        return
    for number, name in enumerate(animation_names(data.document)):
        try:
            keys = _keyframes(data, number, count)
        except SceneError as error:
            yield Judged(file.name, name, problem=error.problems[0])
            continue
        between = np.random.default_rng(number).uniform(keys.min(), keys.max(), len(keys) // 2)
        for peer, poser in peers.items():
            times = keys if peer in AT_KEYS else np.concatenate([keys[::2], between])
            try:
                yield _compared(file, number, times.tolist(), poser)._replace(animation=name, peer=peer)
            except ClrtError as error:
                yield Judged(file.name, name, peer, problem=str(error))


def _keyframes(data: GltfData, animation: int, count: int) -> Doubles:
    """Return up to `count` keyframe times, evenly chosen from those that the most channels share."""
    source = parse_animation(data.document, animation)
    tracks = [data.array(source.samplers[each.sampler].input, "SCALAR", "a sampler")[:, 0] for each in source.channels]
    times, shared = np.unique(np.concatenate([np.unique(track) for track in tracks]), return_counts=True)
    best = times[shared == shared.max()].astype(np.float64)
    return np.asarray(best[np.unique(np.linspace(0, len(best) - 1, count).round().astype(int))])


def _compared(file: Path, animation: int, times: Sequence[float], poser: Poser) -> Judged:
    model = read_model(file, choice=ModelChoice(animation=animation))
    assert model.animation is not None
    points, box, vertices = [], [], 0
    for time, theirs in zip(times, poser(file, animation, times)):
        pose = model.animation.pose(time)
        meshes = [*pose.meshes, *map(baked, pose.instances)]
        ours = np.concatenate([mesh.vertices[np.unique(mesh.faces)] for mesh in meshes]).astype(np.float64)
        boxes = np.array([[each.min(axis=0), each.max(axis=0)] for each in (ours, theirs)])
        size = np.linalg.norm(boxes[0, 1] - boxes[0, 0])
        points.append(float(max(_farthest(ours, theirs), _farthest(theirs, ours)) / size))
        box.append(float(np.abs(boxes[1] - boxes[0]).max() / size))
        vertices = len(ours)
    worst = float(times[int(np.argmax(points))])
    return Judged(file.name, "", "", len(points), vertices, max(points), max(box), worst)


def _farthest(some: Doubles, others: Doubles) -> float:
    """Return the greatest distance from a point to the nearest of the others."""
    from scipy.spatial import KDTree

    return float(np.max(KDTree(others).query(some)[0]))
