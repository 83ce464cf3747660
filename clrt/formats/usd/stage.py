"""Content of a USD file as arrays, read by usd-core in the decoder process.

Arrays: of shape number i "points i" (n, 3), "counts i" (f,), "indices i" (c,), "holes i", "subset i j", and "primvar i
j" (k, c); "texture t", the bytes of an image in an archive; "numbers" (k,) and "matrices" (k, 4, 4), placed shapes.
Facts: `meters` per unit, `up`, `seconds` and `fps` of its animation, `layers`, files that were read; `shapes`,
`materials`, `textures`, `lights` and `cameras`, a dict for each; `ignored`, counts by what it is.
"""

from __future__ import annotations

import os
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .stage_lights import camera, light
from .stage_materials import Materials
from .stage_shapes import Shapes

Array = NDArray[Any]
Found = tuple[dict[str, Array], dict[str, Any]]

#: Maximum number of prims and of placed shapes, and of point instancers inside each other.
MOST_PRIMS = 1 << 20
MOST_PLACES = 1 << 20
MOST_DEPTH = 16
#: Attributes of a SkelAnimation.
ANIMATED = ("translations", "rotations", "scales", "blendShapeWeights")
#: Purposes that are rendered.
RENDERED = ("default", "render")


def decode(file: str, time: float | None = None) -> Found:
    """Read a file at a time in seconds; None for the first time with values.

    Raises ValueError for a malformed file, and for too many prims; pxr may raise other exceptions.
    """
    os.environ.setdefault("PXR_WORK_THREAD_LIMIT", "4")  # threads take memory, which is limited
    from pxr import Tf, Usd, UsdGeom

    try:
        stage = Usd.Stage.Open(file)
    except Tf.ErrorException as error:
        raise ValueError(str(error.args[0].commentary)) from None
    start = stage.GetStartTimeCode() if stage.HasAuthoredTimeCodeRange() else None
    code = Usd.TimeCode.EarliestTime() if start is None else Usd.TimeCode(start)
    if time is not None:
        code = Usd.TimeCode((start or 0.0) + time * stage.GetTimeCodesPerSecond())
    seconds = _seconds(stage)
    _bake_skins(stage, 0.0 if start is None and time is None else code.GetValue())
    content = _Content(code)
    content.add(stage.GetPseudoRoot())
    numbers, matrices = content.places()
    content.arrays |= {"numbers": numbers, "matrices": matrices.swapaxes(1, 2)}
    layers = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    return content.arrays, {
        "meters": UsdGeom.GetStageMetersPerUnit(stage),
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "seconds": seconds,
        "fps": stage.GetFramesPerSecond(),
        "layers": layers,
        "shapes": content.shapes.facts,
        "materials": content.materials.facts,
        "textures": content.materials.textures,
        "lights": content.lights,
        "cameras": content.cameras,
        "ignored": {what: count for what, count in content.ignored.items() if count},
    }


def _seconds(stage: Any) -> float:
    """Return the duration of the stage's time codes; 0 if it has none, or no values at times."""
    if not stage.HasAuthoredTimeCodeRange() or not any(layer.ListAllTimeSamples() for layer in stage.GetUsedLayers()):
        return 0.0
    codes, rate = stage.GetEndTimeCode() - stage.GetStartTimeCode(), stage.GetTimeCodesPerSecond()
    return float(codes / rate) if rate > 0 and 0 < codes < np.inf else 0.0


def _bake_skins(stage: Any, time: float) -> None:
    """Replace the points of skinned meshes by those that their skeletons make of them at a time code.

    BakeSkinning skips times between the samples of an animation, which therefore gets one.
    """
    from pxr import Gf, UsdSkel

    if not any(prim.IsA(UsdSkel.Root) for prim in stage.Traverse()):
        return
    stage.GetSessionLayer().timeCodesPerSecond = stage.GetTimeCodesPerSecond()
    stage.SetEditTarget(stage.GetSessionLayer())
    for animation in [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]:
        for attribute in map(animation.GetAttribute, ANIMATED):
            if (value := attribute.Get(time)) is not None:
                attribute.Set(value, time)
    UsdSkel.BakeSkinning(stage.Traverse(), Gf.Interval(time, time))


class Visit(NamedTuple):
    """A prim to visit, with its parent's matrix (4, 4), for row vectors, and purpose."""

    prim: Any
    matrix: Array
    purpose: str


class _Content:
    """What is found below prims; `matrices` act on row vectors. Below prototypes of point instancers, `outer` is the
    content that they are part of, whose shapes and materials are shared."""

    def __init__(self, code: Any, outer: _Content | None = None) -> None:
        self._code = code
        self._depth: int = outer._depth + 1 if outer else 0
        self.arrays: dict[str, Array] = outer.arrays if outer else {}
        self.ignored: Counter[str] = outer.ignored if outer else Counter()
        self.materials: Materials = outer.materials if outer else Materials(code, self.arrays, self.ignored)
        self.shapes: Shapes = outer.shapes if outer else Shapes(code, self.arrays, self.materials, self.ignored)
        self.lights: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []
        self._numbers: list[Array] = [np.zeros(0, np.int64)]
        self._matrices: list[Array] = [np.zeros((0, 4, 4))]
        self._prims = self._placed = 0

    def places(self) -> tuple[Array, Array]:
        """Return the numbers of placed shapes, and their matrices."""
        return np.concatenate(self._numbers), np.concatenate(self._matrices)

    def add(self, root: Any) -> None:
        """Add what is below a prim, and itself."""
        from pxr import Usd

        visits = [Visit(root, np.eye(4), "default")]
        below = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        while visits:
            self._prims += 1
            if self._prims > MOST_PRIMS:
                raise ValueError(f"it has more than {MOST_PRIMS} prims")
            visit = self._entered(visits.pop())
            if visit is not None and self._visit(visit):
                children = visit.prim.GetFilteredChildren(below)
                visits += [Visit(child, visit.matrix, visit.purpose) for child in reversed(children)]

    def _entered(self, visit: Visit) -> Visit | None:
        """Return the prim with its own matrix and purpose; None if it is invisible, with all below."""
        from pxr import UsdGeom

        prim, matrix, purpose = visit
        if (imageable := UsdGeom.Imageable(prim)) and imageable.GetVisibilityAttr().Get(self._code) == "invisible":
            return None
        if imageable and imageable.GetPurposeAttr().HasAuthoredValue():
            purpose = str(imageable.GetPurposeAttr().Get())
        if xformable := UsdGeom.Xformable(prim):
            local = np.array(xformable.GetLocalTransformation(self._code))
            matrix = local if xformable.GetResetXformStack() else local @ matrix
        return Visit(prim, matrix, purpose)

    def _visit(self, visit: Visit) -> bool:
        """Add a prim itself, and return whether those below are to be visited."""
        from pxr import UsdGeom, UsdLux

        prim, matrix, purpose = visit
        if prim.IsA(UsdGeom.Camera):
            self.cameras.append(camera(prim, matrix, self._code))
        elif prim.HasAPI(UsdLux.LightAPI) and purpose in RENDERED:
            if (found := light(prim, matrix, self._code, self.materials)) is None:
                self.ignored[f"lights of type {prim.GetTypeName()}"] += 1
            else:
                self.lights.append(found)
        if prim.IsA(UsdGeom.PointInstancer):
            if purpose in RENDERED:
                self._instances(prim, matrix)
            return False
        if prim.IsA(UsdGeom.Gprim) and purpose in RENDERED:
            number = self.shapes.number(prim)
            if number is not None:
                self._place(np.array([number]), matrix[None])
        return True

    def _place(self, numbers: Array, matrices: Array) -> None:
        self._placed += len(numbers)
        if self._placed > MOST_PLACES:
            raise ValueError(f"it places more than {MOST_PLACES} meshes")
        self._numbers.append(numbers)
        self._matrices.append(matrices)

    def _instances(self, prim: Any, matrix: Array) -> None:
        """Place the instances of a point instancer."""
        from pxr import UsdGeom

        instancer = UsdGeom.PointInstancer(prim)
        indices = np.array(instancer.GetProtoIndicesAttr().Get(self._code) or (), np.int64)
        given = instancer.ComputeInstanceTransformsAtTime(
            self._code, self._code, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        transforms = np.array(given).reshape(-1, 4, 4)
        mask = instancer.ComputeMaskAtTime(self._code)
        shown = np.array(mask, np.bool_) if mask else np.ones(len(indices), np.bool_)
        if len(transforms) != len(indices) or len(shown) != len(indices):
            self.ignored["point instancers of arrays that differ in length"] += 1
            return
        for number, target in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
            chosen = transforms[shown & (indices == number)]
            root = prim.GetStage().GetPrimAtPath(target)
            if len(chosen) and root:
                numbers, matrices = self._prototype(root, len(chosen))
                self._place(numbers, (matrices[:, None] @ (chosen @ matrix)[None]).reshape(-1, 4, 4))

    def _prototype(self, root: Any, count: int) -> tuple[Array, Array]:
        """Return the numbers of a prototype's shapes, each `count` times, and their own matrices."""
        inner = _Content(self._code, self)
        if inner._depth > MOST_DEPTH:
            raise ValueError(f"its point instancers are nested more than {MOST_DEPTH} deep")
        inner.add(root)
        self.ignored["lights of point instancers"] += len(inner.lights)
        numbers, matrices = inner.places()
        self._prims += inner._prims
        if len(numbers) * count > MOST_PLACES:
            raise ValueError(f"it places more than {MOST_PLACES} meshes")
        return np.repeat(numbers, count), matrices
