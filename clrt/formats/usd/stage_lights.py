"""Lights and cameras of a USD stage, in the decoder process."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from .stage_materials import Materials

#: Types of light, and the inputs that they have beyond those of all.
LIGHTS = {
    "DistantLight": ("angle",),
    "SphereLight": ("radius",),
    "RectLight": ("width", "height", "texture:file"),
    "DiskLight": ("radius",),
    "CylinderLight": ("radius", "length"),
    "DomeLight": ("texture:file", "texture:format"),
    "DomeLight_1": ("texture:file", "texture:format"),
}


def light(prim: Any, matrix: NDArray[Any], code: Any, materials: Materials) -> dict[str, Any] | None:
    """Return the type, name, matrix for column vectors and inputs of a light; `color` includes intensity, exposure and
    color temperature. None for unknown types."""
    from pxr import UsdLux, UsdShade

    kind = str(prim.GetTypeName())
    if kind not in LIGHTS:
        return None
    source = UsdLux.LightAPI(prim)
    strength = source.GetIntensityAttr().Get(code) * 2.0 ** source.GetExposureAttr().Get(code)
    color = [strength * value for value in source.GetColorAttr().Get(code)]
    if source.GetEnableColorTemperatureAttr().Get(code):
        white = UsdLux.BlackbodyTemperatureAsRgb(source.GetColorTemperatureAttr().Get(code))
        color = [value * part for value, part in zip(color, white)]
    facts: dict[str, Any] = {
        "type": kind.removesuffix("_1"),
        "name": str(prim.GetName()),
        "matrix": matrix.T.tolist(),
        "color": color,
        "normalize": bool(source.GetNormalizeAttr().Get(code)),
        "point": bool(prim.GetAttribute("treatAsPoint").Get(code)),
        "pole": str(prim.GetAttribute("poleAxis").Get(code) or "Y"),
    }
    for name in LIGHTS[kind]:
        if name == "texture:file":
            facts["texture"] = materials.image(UsdShade.Input(prim.GetAttribute("inputs:texture:file")))
        else:
            value = prim.GetAttribute(f"inputs:{name}").Get(code)
            facts[name] = value if isinstance(value, float) else str(value)
    if prim.HasAPI(UsdLux.ShapingAPI):
        shaping = UsdLux.ShapingAPI(prim)
        facts["cone"] = shaping.GetShapingConeAngleAttr().Get(code)
        facts["softness"] = shaping.GetShapingConeSoftnessAttr().Get(code)
    return facts


def camera(prim: Any, matrix: NDArray[Any], code: Any) -> dict[str, Any]:
    """Return the name, matrix for column vectors, view and lens of a camera, with lengths in the stage's unit."""
    from pxr import Gf, UsdGeom

    source = UsdGeom.Camera(prim).GetCamera(code)
    return {
        "name": str(prim.GetName()),
        "matrix": matrix.T.tolist(),
        "perspective": source.projection == Gf.Camera.Perspective,
        "fov": source.GetFieldOfView(Gf.Camera.FOVVertical),
        "height": source.verticalAperture * Gf.Camera.APERTURE_UNIT,
        "focal_length": source.focalLength * Gf.Camera.FOCAL_LENGTH_UNIT,
        "f_stop": source.fStop,
        "focus_distance": source.focusDistance,
        "offset": bool(source.horizontalApertureOffset or source.verticalApertureOffset),
    }
