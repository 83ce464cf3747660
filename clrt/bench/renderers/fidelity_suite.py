"""Scenarios of github.com/KhronosGroup/glTF-Render-Fidelity, and the images of other path tracers.

A scenario is a model, an environment map, and an orbit camera (`test/config.json` of the repository's submodule,
glTF-Render-Fidelity-Generator). The images ("goldens") are those of the submodule, or else the smaller ones of the
website. All were tone mapped by three.js' fit of ACES, then encoded.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...formats.images.image_reader import linear_from_srgb, read_texels
from ...scene.model import Camera

Floats = NDArray[np.float32]

GENERATOR = "glTF-Render-Fidelity-Generator"
#: The path tracers among the renderers, by file name.
PATH_TRACERS = ("blender-cycles", "vray", "stellar", "dspbr-pt", "three-gpu-pathtracer")
#: Exponents of renderers whose scripts encode by the power 1/2.2; the others use the sRGB curve.
POWER = {"blender-cycles": 2.2, "vray": 2.2}
#: Defaults of a scenario (src/config-reader.ts).
LIGHTING, SIZE, FOV = "environments/lightroom_14b.hdr", {"width": 768, "height": 768}, 45.0
TARGET, ORBIT = {"x": 0.0, "y": 0.0, "z": 0.0}, {"theta": 0.0, "phi": 90.0, "radius": 1.0}
#: Width in pixels of the website's images, to which larger ones were reduced by the Lanczos kernel with this many lobes
#: (sharp's `resize`), and the quality of their lossy compression, which halves the resolution of chroma.
WEBSITE_WIDTH, LOBES, QUALITY = 512, 3, 90
#: The fit's exposure factor, and the matrices from linear Rec. 709 to its space and back (Hill, BakingLab; MIT).
EXPOSURE = 1 / 0.6
ACES_IN = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
ACES_OUT = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])


class Scenario(NamedTuple):
    """A scenario. lighting: environment map, also the background if `skybox`; otherwise the background is transparent.
    size: nominal (width, height); goldens: image files by path tracer."""

    name: str
    model: Path
    lighting: Path
    camera: Camera
    size: tuple[int, int]
    skybox: bool
    goldens: dict[str, Path]


def scenarios(folder: Path) -> list[Scenario]:
    """Return a checkout's scenarios for which a path tracer's image exists. Raises UsageError if there are none."""
    config = folder / GENERATOR / "test" / "config.json"
    try:
        entries = json.loads(config.read_text(encoding="utf-8"))["scenarios"]
        found = [_scenario(folder, entry) for entry in entries]
    except FileNotFoundError:
        raise UsageError(
            f"{config}: is missing; clone KhronosGroup/glTF-Render-Fidelity with --recurse-submodules "
            f"and name its folder"
        ) from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UsageError(f"{config}: is not a list of scenarios ({error!r}); fetch it again") from None
    found = [scenario for scenario in found if scenario.goldens]
    if not found:
        raise UsageError(f"{folder}: has no image by {', '.join(PATH_TRACERS)}; fetch its files in Git LFS")
    return found


def _scenario(folder: Path, entry: dict[str, Any]) -> Scenario:
    """Parse an entry of the config; its paths are relative to a folder of the generator's website."""
    generator, name = folder / GENERATOR, entry["name"]
    size = SIZE | entry.get("dimensions", {})
    golden = {"": generator / "test" / "goldens" / name, ".thumb": folder / "public" / "thumbnails" / "goldens" / name}
    goldens = {
        renderer: path
        for renderer in PATH_TRACERS
        for part, place in golden.items()
        for path in [place / f"{renderer}-golden{part}{'.webp' if part else '.png'}"]
        if path.is_file()
    }
    return Scenario(
        name,
        generator / _inside(entry["model"]),
        generator / _inside(entry.get("lighting", LIGHTING)),
        orbit_camera(
            TARGET | entry.get("target", {}), ORBIT | entry.get("orbit", {}), float(entry.get("verticalFoV", FOV))
        ),
        (int(size["width"]), int(size["height"])),
        bool(entry.get("renderSkybox", False)),
        goldens,
    )


def files_of(model: Path) -> list[Path]:
    """Return the model's file and, if it is glTF JSON, the files it references."""
    try:
        document = json.loads(model.read_text(encoding="utf-8")) if model.suffix == ".gltf" else {}
        named = [one.get("uri", "data:") for part in ("buffers", "images") for one in document.get(part, [])]
    except (OSError, ValueError, AttributeError):
        named = []  # reported when the model is read
    return [model, *(model.parent / unquote(uri) for uri in named if not uri.startswith("data:"))]


def _inside(path: str) -> str:
    return path.removeprefix("/").replace("../", "")


def orbit_camera(target: dict[str, float], orbit: dict[str, float], fov_degrees: float) -> Camera:
    """Return a camera `radius` away from the target: phi degrees from +Y, theta from +Z towards +X."""
    theta, phi = np.radians([orbit["theta"], orbit["phi"]])
    away = np.array([np.sin(phi) * np.sin(theta), np.cos(phi), np.sin(phi) * np.cos(theta)])
    center = np.array([target["x"], target["y"], target["z"]])
    x, y, z = (center + orbit["radius"] * away).tolist()
    at_x, at_y, at_z = (center + (orbit["radius"] - 1) * away).tolist() if orbit["radius"] < 1e-5 else center.tolist()
    return Camera(position=(x, y, z), look_at=(at_x, at_y, at_z), fov_degrees=fov_degrees)


def tone_mapped(linear: NDArray[Any]) -> Floats:
    """Tone map linear Rec. 709 to the display's linear light, in [0, 1]."""
    v = np.maximum(linear, 0).astype(np.float64) @ (EXPOSURE * ACES_IN.T)
    fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    return np.asarray(np.clip(fitted @ ACES_OUT.T, 0, 1), np.float32)


def golden(renderer: str, path: Path, size: tuple[int, int]) -> tuple[Floats, Floats] | None:
    """Return the image as `over_white`; None if its aspect ratio differs, as with a different framing."""
    rgba = np.asarray(read_texels(path) / 255, np.float32)
    width, height = size
    if abs(rgba.shape[0] * width / (rgba.shape[1] * height) - 1) > 0.02:
        return None
    return over_white(shrunk(rgba, size), POWER.get(renderer))


def shrunk(rgba: Floats, size: tuple[int, int]) -> Floats:
    """Reduce encoded colors and alpha, (h, w, 4) in [0, 1], as the website does: colors are weighted by alpha. So text,
    highlights and edges smaller than a pixel have the same weight as in the images reduced there."""
    premultiplied = rgba * np.concatenate(
        [np.broadcast_to(rgba[..., 3:], (*rgba.shape[:2], 3)), np.ones_like(rgba[..., 3:])], axis=2
    )
    pixels = np.clip(lanczos(premultiplied, size), 0, 1)
    pixels[..., :3] = np.minimum(pixels[..., :3] / np.maximum(pixels[..., 3:], 1 / 255), 1)
    return pixels


def compressed(rgba: Floats) -> Floats:
    """Return the image after the website's compression."""
    import imageio.v3 as imageio

    stored = imageio.imwrite("<bytes>", np.rint(rgba * 255).astype(np.uint8), extension=".webp", quality=QUALITY)
    return np.asarray(imageio.imread(stored, extension=".webp", mode="RGBA") / 255, np.float32)


def over_white(rgba: Floats, power: float | None = None) -> tuple[Floats, Floats]:
    """Return the display's linear light over white, (h, w, 3), and alpha, (h, w). power: None for the sRGB curve."""
    colors, alpha = rgba[..., :3], rgba[..., 3:]
    decoded = linear_from_srgb(colors) if power is None else colors**power
    return np.asarray(decoded * alpha + 1 - alpha, np.float32), alpha[..., 0]


def reduced(pixels: Floats, size: tuple[int, int]) -> Floats:
    """Reduce (h, w, c) to (height, width, c) by means over the area of each pixel."""
    return _resampled(pixels, size, _averages)


def lanczos(pixels: Floats, size: tuple[int, int]) -> Floats:
    """Resample (h, w, c) to (height, width, c) by the Lanczos kernel, which rings: values may leave their range."""
    return _resampled(pixels, size, _lanczos_weights)


def _resampled(pixels: Floats, size: tuple[int, int], weights: Callable[[int, int], Floats]) -> Floats:
    width, height = size
    return np.ascontiguousarray(
        weights(pixels.shape[1], width)
        @ (weights(pixels.shape[0], height) @ pixels.transpose(2, 0, 1)).transpose(0, 2, 1)
    ).transpose(2, 1, 0)


def _averages(n: int, m: int) -> Floats:
    """Return (m, n): row i has the fraction of the i-th of m equal intervals that each of n equal ones covers."""
    edges = np.linspace(0, n, m + 1)
    cells = np.arange(n)
    covered = np.minimum(edges[1:, None], cells + 1) - np.maximum(edges[:-1, None], cells)
    return np.asarray(np.maximum(covered, 0) * (m / n), np.float32)


def _lanczos_weights(n: int, m: int) -> Floats:
    """Return (m, n): row i has the kernel, scaled to the larger pixels, at the n pixels around the i-th of m."""
    x = ((np.arange(m)[:, None] + 0.5) * n / m - np.arange(n) - 0.5) * min(m / n, 1.0)
    kernel = np.where(np.abs(x) < LOBES, np.sinc(x) * np.sinc(x / LOBES), 0.0)
    return np.asarray(kernel / kernel.sum(axis=1, keepdims=True), np.float32)
