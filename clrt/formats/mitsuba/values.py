"""Values in Mitsuba's XML: numbers, colors, spectra and transforms parsed from the attributes of an element."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.transform import scaling, translation, unit
from ...scene.spectra import rgb_of_spectrum

Doubles = NDArray[np.float64]
Attributes = Mapping[str, str]


class Color(NamedTuple):
    """<rgb>: linear Rec. 709."""

    values: tuple[float, float, float]


class Spectrum(NamedTuple):
    """<spectrum>: values at increasing wavelengths in nm; a single value without wavelengths if it is constant."""

    wavelengths: tuple[float, ...]
    values: tuple[float, ...]


def rgb(value: float | Color | Spectrum, *, emitted: bool = False, bounded: bool = False) -> tuple[float, float, float]:
    """Return the color that Mitsuba's `rgb` variants derive from a value. emitted: it is a radiance or the like, whose
    spectrum is relative to equal energy; bounded: it is a reflectance, clamped to 1."""
    if isinstance(value, Color):
        return value.values
    if isinstance(value, Spectrum) and value.wavelengths:
        red, green, blue = rgb_of_spectrum(value.wavelengths, value.values, lit=not emitted)
        return (min(red, 1.0), min(green, 1.0), min(blue, 1.0)) if bounded else (red, green, blue)
    if isinstance(value, Spectrum) and emitted:
        red, green, blue = rgb_of_spectrum((0, 1e4), value.values * 2, lit=False)
        return red, green, blue
    number = value.values[0] if isinstance(value, Spectrum) else float(value)
    return number, number, number


def numbers(text: str) -> list[float]:
    """Parse a list of numbers separated by commas or spaces. Raises ValueError unless all are finite numbers."""
    found = [float(word) for word in text.replace(",", " ").split()]
    if not np.isfinite(found).all():
        raise ValueError(text)
    return found


def integer(text: str) -> int:
    return int(text.strip())


def boolean(text: str) -> bool:
    return {"true": True, "false": False}[text.strip().lower()]


def color(text: str) -> Color:
    """Parse three numbers, one for grey, or a hexadecimal sRGB color such as #ff8000."""
    if text.strip().startswith("#"):
        from ..images.image_reader import linear_from_srgb

        encoded = np.array([int(text.strip()[i : i + 2], 16) for i in (1, 3, 5)], np.float32)
        red, green, blue = linear_from_srgb(encoded / np.float32(255)).tolist()
        return Color((red, green, blue))
    values = numbers(text)
    red, green, blue = values * 3 if len(values) == 1 else values
    return Color((red, green, blue))


def spectrum(text: str) -> Spectrum:
    """Parse a constant, or pairs of a wavelength and a value."""
    if ":" not in text:
        (value,) = numbers(text)
        return Spectrum((), (value,))
    pairs = [numbers(pair.replace(":", " ")) for pair in text.replace(",", " ").split()]
    wavelengths, values = (tuple(row) for row in zip(*pairs, strict=True))
    if np.any(np.diff(wavelengths) <= 0) or len(wavelengths) < 2:
        raise ValueError(text)
    return Spectrum(wavelengths, values)


def vector(attributes: Attributes, missing: float = 0.0) -> tuple[float, float, float]:
    """Parse three numbers: in `value`, where one number may stand for all, or in x, y and z."""
    if "value" in attributes:
        values = numbers(attributes["value"])
        values = values * 3 if len(values) == 1 else values
    else:
        values = [numbers(attributes[axis])[0] if axis in attributes else missing for axis in "xyz"]
    x, y, z = values
    return x, y, z


def transform(steps: list[tuple[str, Attributes]]) -> Doubles:
    """Return the 4x4 matrix of a <transform>: its steps applied in document order to column vectors."""
    matrix = np.eye(4)
    for name, attributes in steps:
        matrix = STEPS[name](attributes) @ matrix
    return matrix


def _rotate(attributes: Attributes) -> Doubles:
    """Return the rotation by `angle` degrees, counter-clockwise looking against the axis (Rodrigues)."""
    x, y, z = unit(np.array(vector(attributes))).tolist()
    angle = np.radians(numbers(attributes["angle"])[0])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def _look_at(attributes: Attributes) -> Doubles:
    """Return the matrix from camera axes, +z forward, +y up and +x left, to the world."""
    texts = attributes["origin"], attributes["target"], attributes.get("up", "0 1 0")
    origin, target, up = (np.array(vector({"value": text})) for text in texts)
    forward = unit(target - origin)
    left = unit(np.cross(up, forward))
    if not (forward.any() and left.any()):
        raise ValueError("up")
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([left, np.cross(forward, left), forward, origin])
    return matrix


def _matrix(attributes: Attributes) -> Doubles:
    """Parse the rows of a 4x4 or 3x3 matrix."""
    values = numbers(attributes["value"])
    size = {16: 4, 9: 3}[len(values)]
    matrix = np.eye(4)
    matrix[:size, :size] = np.reshape(values, (size, size))
    if matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError("not affine")
    return matrix


STEPS: dict[str, Callable[[Attributes], Doubles]] = {
    "translate": lambda attributes: translation(vector(attributes)),
    "scale": lambda attributes: scaling(vector(attributes, missing=1.0)),
    "rotate": _rotate,
    "lookat": _look_at,
    "matrix": _matrix,
}

Value = bool | int | float | str | Color | Spectrum | tuple[float, float, float] | Doubles
_READERS: dict[str, tuple[Callable[[str], Value], str]] = {
    "float": (lambda text: float(numbers(text)[0]), "a number"),
    "integer": (integer, "an integer"),
    "boolean": (boolean, "true or false"),
    "string": (str, "a string"),
    "rgb": (color, "three numbers"),
    "spectrum": (spectrum, 'a number, or pairs such as "400:0.2, 700:0.8"'),
}


def value_of(element: Element, where: str) -> Value:
    """Parse the value of an element that is not a plugin. Raises SceneError naming what is wrong with it."""
    attributes = element.attrib
    try:
        if element.tag in ("point", "vector"):
            return vector(attributes)
        if element.tag == "transform":
            return transform([(step.tag, step.attrib) for step in element])
        return _READERS[element.tag][0](attributes["value"])
    except (ValueError, KeyError, IndexError):
        wanted = (
            _READERS[element.tag][1]
            if element.tag in _READERS
            else (f"steps from {', '.join(STEPS)}" if element.tag == "transform" else "three numbers")
        )
        given = attributes.get("value", "of these steps" if element.tag == "transform" else "of these attributes")
        raise SceneError(f'{where}: <{element.tag}> "{given}" cannot be read; write {wanted}') from None
