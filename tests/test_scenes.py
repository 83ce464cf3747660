"""The scenes in scenes/, and the manual of their format."""

from __future__ import annotations

import re
import tomllib
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.significance import mean_test, sidak
from clrt.formats.images.image_reader import read_picture
from clrt.formats.load_scene import load
from clrt.formats.toml.instance_table import InstanceTable
from clrt.formats.toml.mesh_table import MeshTable
from clrt.scene.animation import Animation, Keyframe
from clrt.scene.lights import LIGHTS
from clrt.scene.materials.material import SHARED
from clrt.scene.materials.material_types import MATERIALS, Material, MetallicRoughness
from clrt.scene.materials.presets import CONDUCTORS, F0_PRESETS
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere
from clrt.scene.sky.sky import Sky

from .covering import others
from .rendering.ggx import albedo

if TYPE_CHECKING:
    from clrt.device.open import Device

ROOT = Path(__file__).parents[1]
SCENES = sorted((ROOT / "scenes").glob("*.toml"))
#: Scenes rendered by default: the README's first, and two whose programs other tests need as well.
RENDERED = ("spheres", "cornell", "furnace")
MANUAL = (ROOT / "docs" / "scene-format.md").read_text(encoding="utf-8")
#: relMSE of cornell_reference.exr itself: 5.76e-5 at 512x512, a quarter of it for the mean of four pixels.
REFERENCE_RELMSE = 1.44e-5
Doubles = NDArray[np.float64]
#: Keys that are not read as dataclass fields.
ELSEWHERE = {"[environment]": {"sky"}}
#: Fields that are not keys.
NO_KEYS = {"[animation]": {"keyframes"}}


def render(scene: Scene, device: Device, **options: Any) -> tuple[Doubles, Doubles, int]:
    """Return the image, the variance of its pixel means, both (h, w, 3), and the number of dropped samples."""
    from clrt.rendering.renderer import Renderer

    spp = options.pop("spp")
    renderer = Renderer(scene, device=device.info.index, sampler="independent", **options)
    film = list(renderer.passes(spp=spp))[-1].film
    count = film.pixels["count"][..., None].astype(np.float64)
    squares = (film.pixels["square"] + film.pixels["square_error"].astype(np.float64)) / count
    return film.mean, np.maximum(squares - film.mean**2, 0) / (count - 1), film.nonfinite_samples


@pytest.mark.parametrize("name", [*RENDERED, *others(*(path.stem for path in SCENES if path.stem not in RENDERED))])
def test_every_scene_renders(name: str, device: Device) -> None:
    scene = load(ROOT / "scenes" / f"{name}.toml")
    width, height = scene.render.size
    mean, variance, dropped = render(scene, device, size=(64, 64 * height // width), spp=4)
    assert np.isfinite(mean).all() and (mean >= 0).all() and dropped == 0
    assert (mean.mean(axis=(0, 1)) > 0.01).all()
    assert mean.std() > 0.01 and variance.any()  # something is visible, and light reaches it along random paths


def test_readme_names_every_file_and_the_folder_is_small() -> None:
    folder = ROOT / "scenes"
    files = [path for path in folder.rglob("*") if path.is_file()]
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert [path.name for path in files if f"`{path.relative_to(folder)}`" not in text] == ["README.md"]
    assert sum(path.stat().st_size for path in files) < 3e6


def test_cornell_box_is_as_far_from_its_reference_as_its_noise(device: Device) -> None:
    """Compare with another renderer's image by z-tests on our sample variance: the mean of each channel, the means of
    16x16 blocks, and the squared error, whose expectation over pixels is our variance plus the reference's."""
    spp = 64
    reference = read_picture(ROOT / "scenes" / "cornell_reference.exr").astype(np.float64)
    mean, variance, _ = render(load(ROOT / "scenes" / "cornell.toml"), device, spp=spp)
    # The reference has 4096 stratified samples per pixel; its variance is at most spp / 4096 of ours.
    difference, total = mean - reference, variance * (1 + spp / 4096)
    channels = mean_test(difference.mean(axis=(0, 1)), total.mean(axis=(0, 1)), 256 * 256, 0.0)
    assert channels.min() > sidak(1e-4, 3), mean.mean(axis=(0, 1)) / reference.mean(axis=(0, 1))
    blocks = mean_test(_blocks(difference), _blocks(total), 16 * 16, 0.0)
    assert blocks.min() > sidak(1e-4, blocks.size)
    excess = np.mean((difference**2 - variance) / (reference**2 + 0.01), axis=2)
    assert mean_test(excess.mean(), excess.var(ddof=1), excess.size, REFERENCE_RELMSE) > 1e-4


def _blocks(picture: Doubles) -> Doubles:
    """Return the means of 16x16 pixels of a (256, 256, 3) image."""
    return np.asarray(picture.reshape(16, 16, 16, 16, 3).mean(axis=(1, 3)))


def test_furnace(device: Device) -> None:
    """Each sphere is seen from afar: a point at the fraction r of its radius has the cosine sqrt(1 − r²) and shows the
    albedo for it. Diffuse and mirror spheres show 1 up to rounding: no light is sampled, and every sample weighs 1.

    Only the metals, farther back, absorb. The diffuse sphere shows the side from which none of them is visible; for
    r < 0.95 the mirror reflects no direction closer than 35° to the direction back there. For the metals themselves,
    all other spheres fill less than 2·sum (1.25/100k)² < 6e-4 of what any point sees.
    """
    scene = load(ROOT / "scenes" / "furnace.toml")
    mean, variance, _ = render(scene, device, size=(96, 64), spp=64)
    assert mean.max() < 1 + 1e-5
    empty = np.ones(mean.shape[:2], bool)
    for sphere in scene.spheres:
        radii = _radii(sphere, scene.camera)
        empty &= (radii > 1.02).all(axis=(1, 3))
        disc = (radii < 0.95).all(axis=(1, 3))
        if not isinstance(sphere.material, MetallicRoughness):
            assert np.abs(mean[disc] - 1).max() < 1e-5
            continue
        nodes = np.linspace(0, 0.95, 24)
        curve = [
            albedo(sphere.material.lobes.alpha, float(np.sqrt(1 - node**2)), "height_correlated", 200) for node in nodes
        ]
        expected = np.interp(radii, nodes, curve).mean(axis=(1, 3))[disc].mean()
        error = np.sqrt(variance[disc][:, 0].mean() / disc.sum())
        assert abs(mean[disc].mean() - expected) < 6e-4 + 4 * error
    assert empty.any() and (mean[empty] == 1).all()


def _radii(sphere: Sphere, camera: Camera) -> Doubles:
    """Return the distances of 4x4 points in each pixel from the sphere's center, in radii: (64, 4, 96, 4), for a
    distant camera that looks along −Z."""
    y, x = (np.mgrid[:256, :384] + 0.5) / 256 - np.array([0.5, 0.75])[:, None, None]
    height = 2 * (camera.position[2] - sphere.center[2]) * np.tan(np.radians(camera.fov_degrees) / 2)
    distances = np.hypot(x * height - sphere.center[0], -y * height - sphere.center[1])
    return np.asarray(distances / sphere.radius).reshape(64, 4, 96, 4)


def test_the_manuals_example_loads_and_renders(tmp_path: Path, device: Device) -> None:
    example = re.findall(r"```toml\n(.*?)```", MANUAL, re.DOTALL)
    assert len(example) == 1
    (tmp_path / "example.toml").write_text(example[0], encoding="utf-8")
    scene = load(tmp_path / "example.toml")
    assert [mesh.name for mesh in scene.meshes] == ["floor", "lamp"] and len(scene.spheres) == 1
    mean, _, _ = render(scene, device, size=(32, 24), spp=4)
    assert mean.mean() > 0.05


TABLES: dict[str, type] = {
    "[camera]": Camera,
    "[animation]": Animation,
    "[[keyframe]]": Keyframe,
    "[render]": RenderSettings,
    "[environment]": Environment,
    "[sky]": Sky,
    "[materials.NAME]": Material,
    "[[mesh]]": MeshTable,
    "[[instance]]": InstanceTable,
    "[[sphere]]": Sphere,
    **{f'type = "{kind.kernel}"': kind for kind in (*MATERIALS, *LIGHTS)},
}
TABLES['type = "phong"` and `type = "blinn_phong"'] = TABLES.pop('type = "phong"')
del TABLES['type = "blinn_phong"']  # one table for both


@pytest.mark.parametrize("heading", TABLES)
def test_the_manual_has_every_key_with_its_default(heading: str) -> None:
    kind = TABLES[heading]
    rows = _rows(heading)
    shared = SHARED if issubclass(kind, Material) and kind is not Material else frozenset()
    known = {field.name: field for field in fields(kind) if field.name not in shared | NO_KEYS.get(heading, set())}
    assert set(rows) - {"type"} - ELSEWHERE.get(heading, set()) == set(known)
    hints = get_type_hints(kind)
    for name, field in known.items():
        value, default = rows[name]
        for part in (hints[name], *get_args(hints[name])):
            if get_origin(part) is Literal and name != "preset":
                assert re.findall(r'"(\w+)"', value) == list(get_args(part))
        if field.default is MISSING and field.default_factory is MISSING:
            assert default == "required"
        elif field.default is None:
            assert default == "none"
        elif field.default is not MISSING:
            assert _value(default) == field.default


def test_the_manual_has_the_presets_and_the_words_to_come() -> None:
    rows = _rows('type = "metallic_roughness"', "preset")
    assert {name: (_value(f0), float(metal == "metal")) for name, (f0, metal) in rows.items()} == F0_PRESETS
    conductors = _rows('type = "conductor"', "preset")
    assert {name: (_value(eta), _value(k)) for name, (eta, k) in conductors.items()} == CONDUCTORS
    assert replace(MetallicRoughness(), preset="gold").lobes.f0 == F0_PRESETS["gold"][0]


def _rows(heading: str, first: str = "key") -> dict[str, tuple[str, str]]:
    """Return {key: (second, third column)} of the table below a heading whose first column is titled `first`."""
    section = re.split(rf"^##+ `{re.escape(heading)}`$", MANUAL, flags=re.MULTILINE)[1].split("\n#")[0]
    table = section.split(f"| {first} |")[1].split("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in table]
    return {row[0].strip("`"): (row[1], row[2]) for row in cells}


def _value(cell: str) -> Any:
    value = tomllib.loads(f"x = {cell.strip('`')}")["x"]
    return tuple(value) if isinstance(value, list) else value
