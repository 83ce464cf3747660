"""Look of a bare model: light, ground and view of a studio, of a sky, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, degrees
from typing import Any, Literal

import numpy as np

from ..scene.default_sky import SUN, default_sky
from ..scene.frame_model import bounds
from ..scene.geometry.transform import rotation, transform_light
from ..scene.model import Camera, Display, Environment, Ground, Instance, Mesh, Model, RenderSettings
from ..scene.studio import CAMERA_AZIMUTH, FLOOR_COLOR, KEY, studio

Look = Literal["studio", "sky", "none"]
#: Half the side of the ground, in diagonals of the model's bounding box: its shadow is shorter, and at the edge the
#: model hides less than 1 % of the light.
GROUND_RADIUS = 1.5
#: Estimated error at which a render stops unless other conditions are given, and the most samples per pixel: twice as
#: many as in a scene file, for smooth metal.
ERROR, SPP = 0.02, 128
#: Distance of the ground from the model, in these diagonals, so that it does not coincide with the model's own floor.
GAP = 5e-4
#: Largest coordinate of a ground, below that of float32.
FURTHEST = 1e38


def default_look(model: Model) -> Look:
    """Return "studio" for a model without lights of its own, else "sky"."""
    return "sky" if model.lights or model.emitters or model.environment else "studio"


def look_of(
    look: Look, model: Model, camera: Camera, angle: float, framed: tuple[Sequence[Mesh], Sequence[Instance]]
) -> dict[str, Any]:
    """Return the environment, lights, ground, settings and display of the model's scene, as keywords.

    Lights of the model replace those of the look and its ground, and an environment the look's. The studio's lights are
    placed around the camera. angle: by which the camera was turned about +Y for a view; framed: what stands on the
    ground, in all its poses.
    """
    own = bool(model.lights or model.emitters or model.environment)
    made: dict[str, Any] = {
        "environment": Environment(),
        "lights": [],
        "render": RenderSettings(spp=SPP, error=ERROR),
        "display": Display(view="pbr_neutral"),
    }
    if look == "sky":
        sun = transform_light(SUN, rotation((0.0, angle, 0.0))) if angle else SUN
        made |= {"environment": default_sky(), "lights": [sun]}
    elif look == "studio":
        turn = _turn_to(camera)
        key = transform_light(KEY, rotation((0.0, turn, 0.0))) if turn else KEY
        made |= {"environment": replace(studio(), rotation_degrees=turn), "lights": [key]}
        made |= {} if own else {"ground": _ground(*framed)}
    if own:
        made["lights"] = model.lights
    if model.environment:
        made["environment"] = model.environment
    return made


def _turn_to(camera: Camera) -> float:
    """Return the angle about +Y in degrees, to a tenth, from the camera that the studio is made for to this one."""
    x, _, z = np.subtract(camera.position, camera.look_at).tolist()
    return round(degrees(atan2(x, z)) - CAMERA_AZIMUTH, 1) % 360 if x or z else 0.0


def _ground(meshes: Sequence[Mesh], instances: Sequence[Instance]) -> Ground | None:
    """Return the ground below the lowest vertex; None if float32 has no room for it."""
    low, high = bounds([*meshes], instances)
    size = float(np.linalg.norm(high - low))
    height, radius = float(low[1]) - GAP * size, GROUND_RADIUS * size
    x, z = (low / 2 + high / 2)[[0, 2]].tolist()
    if not 0 < radius or max(abs(x), abs(z), abs(height)) + radius > FURTHEST:
        return None
    return Ground(height=height, center=(x, z), radius=radius, color=(FLOOR_COLOR,) * 3)
