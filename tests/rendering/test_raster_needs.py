"""Requirements of the raster integrator: memory for visible triangles, no BVH if no rays are traced, and a pinhole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.device.buffer_limit import VARIABLE
from clrt.device.launches.device_arrays import on_device
from clrt.device.open import Device
from clrt.errors import DeviceError, NoRoomError, SceneError, UsageError
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.multi_device import MultiDeviceAccumulation
from clrt.rendering.accumulation.raster_bins import RasterBins
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Mirror
from clrt.scene.model import Environment, Scene, Sphere

from .test_raster import AHEAD, PLANTED, SETTINGS, SIZE, ball, plain
from .test_variants import everything


@pytest.mark.programs
def test_several_devices_and_tiles_render_the_same_picture(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """With small buffers and the film on the host, the image is that of one session, bit for bit."""
    films = []
    for limit in ("1G", "80K"):
        monkeypatch.setenv(VARIABLE, limit)
        renderer = Renderer(PLANTED, device=device.info.index, integrator="raster", sampler="independent", spp=4)
        assert isinstance(renderer.session, MultiDeviceAccumulation) == (limit == "80K")
        films.append(list(renderer.passes(spp=4))[-1].film.pixels.tobytes())
    assert films[0] == films[1]


def test_what_does_not_fit_is_refused_with_the_size(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "100K")
    scene = Scene(meshes=[ball(4, (0.0, 0.0, -3.0))], camera=AHEAD)
    with pytest.raises(DeviceError, match="rasterising this view needs a buffer of"):
        Renderer(scene, device=device.info.index, integrator="raster", size=SIZE)


def test_bins_are_in_the_memory_plan(device: Device) -> None:
    """The bins' size is checked against the memory that the scene leaves before they are allocated."""
    scene = Scene(meshes=[ball(4, (0.0, 0.0, -3.0))], camera=AHEAD, render=SETTINGS)
    compiled = compile_scene(scene, Choices(), device=device)
    arguments = [*(on_device(device, array) for _, array in compiled.buffers.values()), compiled.counts[0]]
    bins, launch = RasterBins(device, compiled, arguments), LaunchPlan(SIZE, 2, 0).record(compiled)
    full = {"film": device.info.global_bytes - 64 * 5120 // 4}
    with pytest.raises(NoRoomError, match="outlines .* KiB"):
        bins.of(launch, full)
    assert bins.bytes == 0 and bins.of(launch, {}) and 64 * 5120 // 4 < bins.bytes < 64 * 5120 * 1.5


@pytest.mark.programs
def test_where_no_ray_is_followed_there_is_no_tree(device: Device) -> None:
    """The image is bit-identical to the one with a BVH; first hits of rays remain available on request."""
    balls = [Sphere(center=(-1.5, 0.0, -4.0), radius=0.7), Sphere(center=(1.5, 0.0, -4.0), radius=0.7)]
    sun = DirectionalLight(direction=(-1, -1, 0), irradiance=(1.0, 1.0, 1.0))
    scene = Scene(
        meshes=[ball(3, (0.0, 0.0, -3.0)), plain(9.0, 1.0)],
        spheres=balls,
        lights=[sun],
        camera=AHEAD,
        environment=Environment(color=(0.1, 0.2, 0.3)),
        render=replace(SETTINGS, shadows=False, size=(64, 48)),
    )
    asked = Renderer(scene, device=device.info.index, aovs="object")
    renderer = Renderer(scene, device=device.info.index)
    with_tree, without = (list(each.passes(spp=4))[-1] for each in (asked, renderer))
    assert with_tree.film.pixels.tobytes() == without.film.pixels.tobytes() and without.pixels.std() > 0.1
    assert not {"nodes", "packs", "leaf_triangles", "leaf_spheres"} & set(renderer.compiled.buffers)
    assert renderer.session.device_bytes < asked.session.device_bytes
    assert set(np.unique(asked.aovs(with_tree)["object"])) == {-1, 0, 1, 2, 3}
    with pytest.raises(UsageError, match="first_hits=True"):
        renderer.session.guides()
    shaded, local = (
        replace(scene, render=replace(scene.render, **needed))
        for needed in ({"shadows": True}, {"integrator": "local"})
    )
    for other, wanted in ((shaded, Choices()), (local, Choices()), (scene, Choices(first_hits=True))):
        assert "IN_TREE" in compile_scene(other, wanted).features
    for material in (Mirror(), Dielectric(), Diffuse(opacity=0.5)):
        other = replace(scene, spheres=[replace(balls[0], material=material)])
        assert compile_scene(other, Choices()).tree.nodes > 0


def test_other_scenes_pay_nothing_and_other_cameras_are_refused() -> None:
    scene = everything()
    compiled = compile_scene(scene, Choices())
    assert not {"RASTER", "NO_SHADOWS"} & set(compiled.features) and "Outline" not in compiled.source
    local = replace(scene, render=replace(scene.render, integrator="local"))
    assert "Outline" not in compile_scene(local, Choices()).source
    raster = replace(scene, render=replace(scene.render, integrator="raster"))
    assert "RASTER" in compile_scene(raster, Choices()).features
    with pytest.raises(SceneError, match="pinhole cameras, and the camera has aperture_radius = 0.1"):
        compile_scene(replace(raster, camera=replace(scene.camera, aperture_radius=0.1)), Choices())
