"""Default lighting for a model without lights: a photo studio, with a key light from the upper left of the camera, a
fill from its right and a rim light from behind, in a grey room on a grey floor.

White paper that faces the key light has a radiance of about 1: the view transform "pbr_neutral" then shows matte
surfaces in about their base colors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry.transform import rotation
from .lights import DirectionalLight
from .model import Environment

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Panel:
    """A soft box in the walls: where its middle is, in degrees about +Y from +Z towards +X and above the horizon, its
    width and height in degrees, the width of its soft edge, and its radiance."""

    azimuth: float
    elevation: float
    size: tuple[float, float]
    edge: float
    radiance: float

    def of(self, directions: Doubles) -> Doubles:
        """Return its radiance in unit directions (..., 3): logistic edges, half at the rectangle's."""
        across, up, towards = np.moveaxis(directions @ _frame(self.azimuth, self.elevation), -1, 0)
        away = [np.degrees(np.arctan2(each, np.maximum(towards, 1e-9))) for each in (across, up)]
        inside = [1 / (1 + np.exp((np.abs(part) - side / 2) / self.edge)) for part, side in zip(away, self.size)]
        return np.asarray(np.where(towards > 0, self.radiance * inside[0] * inside[1], 0.0))


def _frame(azimuth: float, elevation: float) -> Doubles:
    """Return the columns right, up and towards of the direction at these angles in degrees."""
    return np.asarray(rotation((-elevation, azimuth, 0.0))[:3, :3])


#: Azimuth of the camera that the lights below are placed around, in degrees: that of `frame_model.THREE_QUARTER`.
CAMERA_AZIMUTH = 27.92
#: Radiance of floor, backdrop and walls, and of the ceiling. White and black objects both contrast with mid-grey.
ROOM, CEILING = 0.35, 0.55
FILL = Panel(azimuth=85, elevation=20, size=(70, 50), edge=6, radiance=0.3)
RIM = Panel(azimuth=205, elevation=38, size=(60, 28), edge=4, radiance=0.8)
#: The key light is sampled by itself. It is as wide as a soft box of 0.93 m at a distance of 1 m: 0.53 degrees, as the
#: sun has, makes 100 times as much noise in smooth metal (docs/measurements/default-look.md).
KEY_AZIMUTH, KEY_ELEVATION = -22, 42
KEY = DirectionalLight(
    direction=tuple((-_frame(KEY_AZIMUTH, KEY_ELEVATION)[:, 2]).round(4).tolist()),
    irradiance=(1.8, 1.8, 1.8),
    angle_degrees=50,
    camera_visible=False,
)
#: Albedo of the floor: lit by the room and the key light, it has the radiance ROOM.
FLOOR_COLOR = 0.362


def studio(height: int = 64) -> Environment:
    """Return the room with its two panels as a latitude–longitude image, (height, 2·height, 3), without the key light.

    Below the horizon it is as bright as the floor (`FLOOR_COLOR`), which therefore has no visible edge.
    """
    grey = _radiance(_directions(height, 2 * height))
    return Environment(image=np.repeat(grey[..., None], 3, axis=2).astype(np.float32))


def _directions(height: int, width: int) -> Doubles:
    """Return the directions to the centers of the texels, (height, width, 3)."""
    polar = np.pi * (np.arange(height)[:, None] + 0.5) / height
    around = 2 * np.pi * (np.arange(width) + 0.5) / width
    flat = np.sin(polar)
    return np.stack([flat * np.sin(around), np.broadcast_to(np.cos(polar), (height, width)), -flat * np.cos(around)], 2)


def _radiance(directions: Doubles) -> Doubles:
    """Return the radiance of the room in unit directions (..., 3)."""
    above = np.maximum(directions[..., 1], 0)
    walls = ROOM + (CEILING - ROOM) * above
    return np.asarray(np.where(above > 0, walls + FILL.of(directions) + RIM.of(directions), ROOM))
