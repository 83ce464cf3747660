"""Colors of pbrt's spectra, which clrt renders as linear Rec. 709.

A reflectance is what the spectrum reflects of D65. An emission is divided by the spectrum's luminance in pbrt-v4,
except for `rgb`, whose white is the color space's illuminant of luminance 1; in v3 it is as written.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.spectra import RGB_FROM_XYZ, black_body, xyz_of_spectrum
from ..referenced_files import note_read
from ..scene_parts.refractive_indices import METALS as MORE_METALS
from .entities import SPECTRA, Entity, Parameter
from .named_spectra import GLASSES, ILLUMINANTS, METALS, SPACES, Triple
from .tokens import Doubles

#: Wavelength of sodium's light in nm, at which an index of refraction is taken.
SODIUM = 587.56
#: Wavelengths between which v3 continues spectra by their first and last values.
FAR = (1.0, 1e5)
#: Maximum size of a file of a spectrum.
MOST_BYTES = 2**22
_METAL = re.compile(r"metal-(\w+)-(eta|k)|(?:.*[/\\])?(\w+)\.(eta|k)\.spd")
Spectrum = tuple[Doubles, Doubles]


class Spectra:
    """Colors of one scene. old: of v3 or before; exposure: the factor by which the film scales all light."""

    def __init__(self, old: bool, exposure: float = 1.0) -> None:
        self._old = old
        self.exposure = exposure

    def reflectance(self, entity: Entity, name: str, default: float) -> Triple:
        """Return a color from 0 to 1."""
        red, green, blue = np.clip(self._plain(entity, name, default, lit=not self._old), 0, 1).tolist()
        return red, green, blue

    def unbounded(self, entity: Entity, name: str, default: float) -> Triple:
        """Return a color of at least 0, such as an absorption."""
        red, green, blue = np.maximum(self._plain(entity, name, default, lit=not self._old), 0).tolist()
        return red, green, blue

    def emission(self, entity: Entity, name: str) -> Triple:
        """Return radiance or the like: the parameter, or white, times the entity's `scale` and the film's exposure."""
        parameter = entity.get(name, *SPECTRA)
        color = np.ones(3) if parameter is None else self._emitted(entity, name, parameter)
        scale = entity.get("scale", "float", "integer", *SPECTRA)
        if scale is not None and scale.type in SPECTRA:
            color = color * self._color(entity, "scale", scale, lit=False)
        else:
            color = color * entity.number("scale", 1.0)
        red, green, blue = np.maximum(color * self.exposure, 0).tolist()
        return red, green, blue

    def metal(self, entity: Entity, name: str, default: Triple) -> Triple:
        """Return an index of refraction, or an extinction coefficient, of a metal."""
        parameter = entity.get(name, *SPECTRA, "float", "integer")
        if parameter is None:
            return default
        if parameter.type == "spectrum" and isinstance(parameter.values, list):
            text = str(parameter.values[0])
            if found := _METAL.fullmatch(text):
                element, quantity = (found[1], found[2]) if found[1] else (found[3], found[4])
                both = METALS.get(element) or MORE_METALS.get(element)
                if both is not None:
                    return both[quantity == "k"]
        return self.unbounded(entity, name, 0.0)

    def index(self, entity: Entity, name: str, default: float) -> tuple[float, float | None]:
        """Return an index of refraction, and the Abbe number of a glass."""
        parameter = entity.get(name, "float", "integer", "spectrum")
        if parameter is None:
            return default, None
        if parameter.type != "spectrum":
            return entity.number(name, default), None
        text = str(parameter.values[0]) if isinstance(parameter.values, list) else ""
        if text.removeprefix("glass-") in GLASSES:
            return GLASSES[text.removeprefix("glass-")]
        wavelengths, values = self._spectrum(entity, name, parameter)
        return float(np.interp(SODIUM, wavelengths, values)), None

    def _plain(self, entity: Entity, name: str, default: float, lit: bool) -> Doubles:
        parameter = entity.get(name, *SPECTRA, "float", "integer")
        if parameter is None:
            return np.full(3, default)
        if parameter.type in ("float", "integer"):
            return np.full(3, entity.number(name, default))
        return self._color(entity, name, parameter, lit)

    def _emitted(self, entity: Entity, name: str, parameter: Parameter) -> Doubles:
        if parameter.type in ("rgb", "xyz") or self._old:
            return self._color(entity, name, parameter, lit=False)
        if isinstance(parameter.values, list) and str(parameter.values[0]) in ILLUMINANTS:
            x, y = ILLUMINANTS[str(parameter.values[0])]
            return RGB_FROM_XYZ @ (x / y, 1, (1 - x - y) / y)
        wavelengths, values = self._spectrum(entity, name, parameter)
        xyz = xyz_of_spectrum(wavelengths, values, lit=False)
        if not xyz[1] > 0:
            raise entity.fault(name, "has no luminance", "write a spectrum that is positive between 360 and 830 nm")
        return np.asarray(RGB_FROM_XYZ @ xyz / xyz[1])

    def _color(self, entity: Entity, name: str, parameter: Parameter, lit: bool) -> Doubles:
        if parameter.type in ("rgb", "xyz"):
            values = np.asarray(parameter.values, np.float64)
            if len(values) != 3:
                raise entity.fault(name, f"has {len(values)} numbers", "write three")
            if parameter.type == "xyz":
                return np.asarray(RGB_FROM_XYZ @ values)
            return values if entity.space not in SPACES else np.asarray(SPACES[entity.space] @ values)
        wavelengths, values = self._spectrum(entity, name, parameter)
        return np.asarray(RGB_FROM_XYZ @ xyz_of_spectrum(wavelengths, values, lit=lit))

    def _spectrum(self, entity: Entity, name: str, parameter: Parameter) -> Spectrum:
        """Return wavelengths in nm and values."""
        if parameter.type == "blackbody":
            numbers = np.asarray(parameter.values, np.float64)
            if not len(numbers) or not numbers[0] > 0:
                raise entity.fault(name, "is not a temperature", "write one in kelvin")
            wavelengths, radiance = (np.array(each) for each in black_body(float(numbers[0])))
            scale = numbers[1] if len(numbers) > 1 else 1.0
            return wavelengths, radiance / max(float(radiance.max()), 1e-300) * scale
        if isinstance(parameter.values, list):
            pairs = _from_file(entity, name, str(parameter.values[0]) if parameter.values else "")
        else:
            pairs = parameter.values
        if len(pairs) % 2 or len(pairs) < 2 or (np.diff(pairs[::2]) <= 0).any():
            raise entity.fault(name, "is not a spectrum", "write pairs of increasing wavelengths in nm and values")
        wavelengths, values = pairs[::2], pairs[1::2]
        if self._old:
            ends = np.clip(FAR, None, [wavelengths[0] - 1, np.inf])
            wavelengths, values = np.r_[ends[0], wavelengths, FAR[1]], np.r_[values[0], values, values[-1]]
        return wavelengths, values


def _from_file(entity: Entity, name: str, text: str) -> Doubles:
    """Read a file of pairs of a wavelength and a value."""
    path: Path = entity.files.path(text, entity.file)
    if not path.is_file() or path.stat().st_size > MOST_BYTES:
        raise entity.fault(
            name, f'names the spectrum "{text}", which is neither known nor a small file', "write its values"
        )
    note_read(path)
    lines = path.read_bytes().decode("latin-1").splitlines()
    try:
        numbers = [float(word) for line in lines for word in line.partition("#")[0].split()]
    except ValueError:
        raise SceneError(f"{path}: is not a spectrum; write pairs of a wavelength in nm and a value") from None
    return np.array(numbers)
