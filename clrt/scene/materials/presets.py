"""Reflectances and indices of refraction of known materials."""

from __future__ import annotations

from typing import Literal

#: Specular reflectance at normal incidence, linear: (F0, metallic). Suchiński 2022, table 6.1.
F0_PRESETS: dict[str, tuple[tuple[float, float, float], float]] = {
    "water": ((0.02, 0.02, 0.02), 0.0),
    "plastic_low": ((0.03, 0.03, 0.03), 0.0),
    "plastic_high": ((0.05, 0.05, 0.05), 0.0),
    "glass_low": ((0.03, 0.03, 0.03), 0.0),
    "glass_high": ((0.08, 0.08, 0.08), 0.0),
    "ruby": ((0.08, 0.08, 0.08), 0.0),
    "diamond": ((0.17, 0.17, 0.17), 0.0),
    "iron": ((0.56, 0.57, 0.58), 1.0),
    "copper": ((0.95, 0.64, 0.54), 1.0),
    "gold": ((1.00, 0.71, 0.29), 1.0),
    "aluminium": ((0.91, 0.92, 0.92), 1.0),
    "silver": ((0.95, 0.93, 0.88), 1.0),
}
Preset = Literal[
    "water",
    "plastic_low",
    "plastic_high",
    "glass_low",
    "glass_high",
    "ruby",
    "diamond",
    "iron",
    "copper",
    "gold",
    "aluminium",
    "silver",
]

Color = tuple[float, float, float]
#: Complex indices of refraction (eta, k) in red, green and blue: at 611, 549 and 464 nm, the hues of Rec. 709's
#: primaries, interpolated between measurements of films. Johnson and Christy 1972 (Phys. Rev. B 6, 4370: gold, copper,
#: silver) and 1974 (Phys. Rev. B 9, 5056: iron, titanium, nickel, chromium), Rakić 1995 (Appl. Opt. 34, 4755:
#: aluminium), as tabulated by refractiveindex.info (CC0).
CONDUCTORS: dict[str, tuple[Color, Color]] = {
    "gold": ((0.223, 0.428, 1.335), (3.204, 2.46, 1.872)),
    "copper": ((0.367, 1.016, 1.246), (3.121, 2.579, 2.452)),
    "silver": ((0.058, 0.06, 0.046), (4.103, 3.589, 2.792)),
    "aluminium": ((1.32, 1.011, 0.683), (7.307, 6.616, 5.623)),
    "iron": ((2.89, 2.95, 2.642), (3.04, 2.93, 2.803)),
    "titanium": ((2.658, 2.54, 2.303), (3.696, 3.43, 3.079)),
    "nickel": ((1.985, 1.92, 1.763), (3.982, 3.61, 3.041)),
    "chromium": ((3.179, 3.18, 2.447), (3.3, 3.33, 3.205)),
}
ConductorPreset = Literal["gold", "copper", "silver", "aluminium", "iron", "titanium", "nickel", "chromium"]
