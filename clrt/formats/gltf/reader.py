"""Reader for glTF 2.0 (.glb, .gltf): the scene's triangles, metallic-roughness materials, cameras and lights.

Unsupported features (lines, unknown extensions, ...) are listed in one logged warning.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.animation import ModelAnimation
from ...scene.frame_model import bounds
from ...scene.geometry.instancing import meshes_by_id
from ...scene.geometry.normals import Normals
from ...scene.geometry.transform import Matrix, translation
from ...scene.model import Mesh, Model
from ...scene.model_pose import own_materials
from ..far_origin import far_center
from ..model_choice import DEFAULT, ModelChoice, chosen
from ..placed_meshes import shown
from . import schema as gltf
from .accessors import GltfData
from .animations import Clip, animation_names
from .cameras import read_cameras
from .graph import NodeGraph
from .instancing import matrices
from .light_units import guess_unit, to_radiometric
from .lights import read_lights
from .materials import Materials
from .morph_targets import weights_of
from .primitives import TRIANGLES, Primitives
from .skins import joint_matrices

log = logging.getLogger(__name__)
#: Mesh, primitive and morph weights, which determine a shape.
Shape = tuple[int, int, tuple[float, ...]]


def read_gltf(path: Path, normals: Normals = "file", choice: ModelChoice = DEFAULT) -> Model:
    """Read the scene of a glTF file: per primitive of each node a Mesh in world coordinates, or an Instance.

    Raises SceneError naming the file and the accessor, node or mesh that is wrong.
    """
    with _named(path):
        return GltfFile(path, normals, choice).model()


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in errors."""
    try:
        with np.errstate(all="ignore"):  # values that are not finite are reported
            yield
    except SceneError as error:
        raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None


class GltfFile:
    """Scene of a file. Its meshes, materials and textures are read once, for all poses of its animation."""

    def __init__(self, path: Path, normals: Normals, choice: ModelChoice) -> None:
        self._path, self._choice = path, choice
        self._data = GltfData(path, choice.ignore_extensions or ())
        document = self._data.document
        variants = document.extensions.KHR_materials_variants.variants
        self._names = {
            "scenes": gltf.unique_names("scene", [scene.name for scene in document.scenes]),
            "animations": animation_names(document),
            "variants": gltf.unique_names("variant", [variant.name for variant in variants]),
        }
        self._scene = None if choice.scene is None else chosen(choice.scene, self._names["scenes"], "scene")
        variant = None if choice.variant is None else chosen(choice.variant, self._names["variants"], "variant")
        self._variant, self._normals = variant, normals
        self._materials = Materials(self._data, variant)
        self._primitives = Primitives(self._data, self._materials, normals)
        self._shapes: dict[Shape, Mesh] = {}
        self._unit, self._center = choice.light_unit, (0.0, 0.0, 0.0)
        #: Bounding box of the last pose that shows anything.
        self._box: NDArray[np.float64] | None = None

    def model(self) -> Model:
        """Return the model as chosen, with its animation, and log what is left out."""
        clip, name, left_out = self._clip()
        asked = clip if self._choice.animated else None
        time = self._choice.time or 0.0
        model, cameras = self._posed(asked, time)
        assert self._box is not None  # _posed raises an error otherwise
        if any(center := far_center(*self._box)):
            self._center = center
            model, cameras = self._posed(asked, time)
        model.contents = self._contents([*left_out, *cameras, *(asked.ignored if asked else [])])
        if model.lights and self._choice.light_unit is None and self._unit != "radiometric":
            model.converted_from = self._unit
        if clip is not None and self._choice.time is None:
            base = replace(model, meshes=list(model.meshes), instances=list(model.instances), lights=list(model.lights))
            own = own_materials(base) if clip.changes_materials else ()
            pose = partial(self._at, clip)
            model.animation = ModelAnimation(name=name, seconds=clip.seconds, base=base, pose=pose, own=own)
        return model

    def _clip(self) -> tuple[Clip | None, str, list[str]]:
        """Return the animation, its name, and what is left out; a faulty one is rejected only if it was asked for."""
        names = self._names["animations"]
        if not (names or self._choice.animated):
            return None, "", []
        index = chosen(self._choice.animation or 0, names, "animation")
        try:
            return Clip(self._data, index), names[index], []
        except SceneError as error:
            if self._choice.animated:
                raise
            return None, "", [f"an animation: {error.problems[0]}"]

    def _at(self, clip: Clip, time: float) -> Model:
        with _named(self._path):
            return self._posed(clip, time)[0]

    def _posed(self, clip: Clip | None, time: float) -> tuple[Model, list[str]]:
        """Return the model at a time of an animation, or without one, and descriptions of cameras that are left out."""
        document = self._data.document if clip is None else clip.posed(self._data.document, time)
        x, y, z = self._center
        graph = NodeGraph(document, self._scene, translation((-x, -y, -z)))
        places = list(self._places(graph, document))
        meshes, instances = shown(places)
        every = [*meshes, *meshes_by_id(instances).values()]
        if every:
            self._box = np.stack(bounds(meshes, instances))
        elif self._box is None:
            raise SceneError("its scene contains no triangles; export a model with triangle meshes")
        box = self._box
        cameras, left_out = read_cameras(document, graph.placed, box.mean(axis=0))
        lights = list(read_lights(document, graph.placed))
        self._unit = self._unit or guess_unit(lights, str(document.asset.generator), box)
        lights = [to_radiometric(light, self._unit) for light in lights]
        model = Model(meshes=meshes, instances=instances, cameras=cameras, lights=lights, center=self._center)
        return model, left_out

    def _places(self, graph: NodeGraph, document: gltf.Document) -> Iterator[tuple[Mesh, Matrix]]:
        """Yield the meshes of all nodes with their matrices.

        A skinned mesh is in the world already, whatever its node's own transform is (specification 3.7.3.3).
        """
        shapes: dict[Shape, Mesh] = {}
        primitives, known = self._primitives, self._shapes
        if document.materials is not self._data.document.materials:
            materials = Materials(self._data, self._variant, document.materials, self._materials.textures)
            primitives, known = Primitives(self._data, materials, self._normals), {}
        for node, matrix in graph.placed:
            if node.mesh is None:
                continue
            weights = weights_of(node, gltf.entry(document.meshes, node.mesh, "mesh", "a node"))
            joints = None if node.skin is None else joint_matrices(self._data, graph, node.skin)
            rigid, bent = list[Mesh](), list[Mesh]()
            for number, stored in enumerate(primitives.of(node.mesh)):
                if joints is not None and stored.influences is not None:
                    bent.append(primitives.shaped(stored, weights, joints))
                    continue
                key = node.mesh, number, weights
                shapes[key] = known.get(key) or shapes.get(key) or primitives.shaped(stored, weights)
                rigid.append(shapes[key])
            yield from ((mesh, place) for place in matrices(self._data, node, matrix) for mesh in rigid)
            yield from ((mesh, np.eye(4)) for mesh in bent)
        if primitives is self._primitives:
            self._shapes = shapes

    def _contents(self, others: Iterable[str]) -> dict[str, list[str]]:
        """Return what the file has by kind, see `Model`, and log one warning that lists what is not rendered.

        others: descriptions of what is left out and why.
        """
        document = self._data.document
        primitives = [primitive for mesh in document.meshes for primitive in mesh.primitives]
        why = {"points and lines": "only triangles are rendered"}
        left_out = why if any(primitive.mode < TRIANGLES for primitive in primitives) else {}
        used = {*document.extensionsUsed, *document.extensionsRequired}
        left_out |= {f"the extension {name}": "is not supported" for name in sorted(used - gltf.EXTENSIONS)}
        for name, features in self._materials.unused.items():
            left_out[f'{" and ".join(features)} of material "{name}"'] = "is not rendered with its other features"
        left_out |= dict.fromkeys(others, "")
        if left_out:
            log.warning("%s: left out: %s", self._path, ", ".join(left_out))
        reasons = [": ".join(filter(None, pair)) for pair in left_out.items()]
        return {
            **self._names,
            "extensions": sorted(used & gltf.EXTENSIONS),
            "left_out": [*reasons, *self._materials.textures.unread],
        }
