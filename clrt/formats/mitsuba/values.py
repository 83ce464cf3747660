"""Values in Mitsuba's XML: numbers, colors, spectra and transforms parsed from the attributes of an element."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.transform import axis_rotation, looking_at, scaling, translation
from ...scene.spectra import black_body, rgb_of_spectrum
from .elements import Element

Doubles = NDArray[np.float64]
Attributes = Mapping[str, str]


#: Number of characters of a value in a message.
SHOWN = 60
HEXADECIMAL = re.compile("#" + "([0-9a-fA-F]{2})" * 3)


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
    if "#" in text:
        return encoded_color(text)
    values = numbers(text)
    red, green, blue = values * 3 if len(values) == 1 else values
    return Color((red, green, blue))


def encoded_color(text: str) -> Color:
    """Parse a color encoded in sRGB: three numbers, one for grey, or a hexadecimal one."""
    from ..images.image_reader import linear_from_srgb

    if found := HEXADECIMAL.fullmatch(text.strip()):
        values = [int(digits, 16) / 255 for digits in found.groups()]
    else:
        values = numbers(text)
        values = values * 3 if len(values) == 1 else values
    red, green, blue = linear_from_srgb(np.array(values, np.float32)).tolist()
    return Color((red, green, blue))


def spectrum(text: str) -> Spectrum | Color:
    """Parse a constant, pairs of a wavelength and a value, or, as in Mitsuba 0.x, three numbers for a linear color."""
    if ":" not in text:
        if len(numbers(text)) == 3:
            return color(text)
        (value,) = numbers(text)
        return Spectrum((), (value,))
    pairs = [numbers(pair.replace(":", " ")) for pair in text.replace(",", " ").split()]
    wavelengths, values = (tuple(row) for row in zip(*pairs, strict=True))
    if np.any(np.diff(wavelengths) <= 0) or len(wavelengths) < 2:
        raise ValueError(text)
    return Spectrum(wavelengths, values)


def blackbody(temperature: str, scale: str) -> Color:
    """Return the radiance of a black body in W·m⁻²·sr⁻¹·nm⁻¹, by its temperature in kelvin (Planck's law)."""
    (kelvin,), (factor,) = numbers(temperature.strip().removesuffix("K")), numbers(scale)
    if not kelvin > 0:
        raise ValueError(temperature)
    red, green, blue = (factor * part for part in rgb_of_spectrum(*black_body(kelvin), lit=False))
    return Color((red, green, blue))


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
    return axis_rotation(vector(attributes), numbers(attributes["angle"])[0])


def _look_at(attributes: Attributes) -> Doubles:
    texts = attributes["origin"], attributes["target"], attributes.get("up", "0 1 0")
    return looking_at(*(vector({"value": text}) for text in texts))


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
#: Readers of the elements with a plain value, and what to write.
READERS: dict[str, tuple[Callable[[Attributes], Value], str]] = {
    "float": (lambda attributes: float(numbers(attributes["value"])[0]), "a number"),
    "integer": (lambda attributes: integer(attributes["value"]), "an integer"),
    "boolean": (lambda attributes: boolean(attributes["value"]), "true or false"),
    "string": (lambda attributes: attributes["value"], "a string"),
    "rgb": (lambda attributes: color(attributes["value"]), "three numbers"),
    "srgb": (lambda attributes: encoded_color(attributes["value"]), "three numbers, or #rrggbb"),
    "spectrum": (lambda attributes: spectrum(attributes["value"]), 'a number, or pairs such as "400:0.2, 700:0.8"'),
    "blackbody": (
        lambda attributes: blackbody(attributes["temperature"], attributes.get("scale", "1")),
        'a temperature in kelvin such as "5000"',
    ),
}


def value_of(element: Element, where: str) -> Value:
    """Parse the value of an element that is not a plugin. Raises SceneError naming what is wrong with it."""
    attributes = element.attrib
    try:
        if element.tag in ("point", "vector"):
            return vector(attributes)
        if element.tag == "transform":
            return transform([(step.tag, step.attrib) for step in element])
        return READERS[element.tag][0](attributes)
    except (ValueError, KeyError, IndexError):
        wanted = (
            READERS[element.tag][1]
            if element.tag in READERS
            else (f"steps from {', '.join(STEPS)}" if element.tag == "transform" else "three numbers")
        )
        given = attributes.get("value", "of these steps" if element.tag == "transform" else "of these attributes")
        raise SceneError(f'{where}: <{element.tag}> "{given:.{SHOWN}}" cannot be read; write {wanted}') from None
