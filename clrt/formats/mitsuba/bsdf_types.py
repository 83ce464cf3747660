"""The conversions of BSDFs by Mitsuba's names."""

from __future__ import annotations

from .bsdfs import blend, bumpmap, conductor, dielectric, diffuse, mask, normalmap, twosided
from .materials import Convert
from .plastics import plastic
from .principled import principled
from .stand_ins import STAND_INS, phong

TYPES: dict[str, Convert] = {
    "diffuse": diffuse,
    "twosided": twosided,
    "mask": mask,
    "normalmap": normalmap,
    "bumpmap": bumpmap,
    "blendbsdf": blend,
    "dielectric": dielectric,
    "thindielectric": dielectric,
    "roughdielectric": dielectric,
    "conductor": conductor,
    "roughconductor": conductor,
    "plastic": plastic,
    "roughplastic": plastic,
    "principled": principled,
    "phong": phong,
    **STAND_INS,
}
