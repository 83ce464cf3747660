"""The ground: it is seen in images of light alone, catches shadows where it is hidden, and never hides the model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.scene.on_ground import on_ground
from clrt.scene.studio import FLOOR_COLOR, KEY, ROOM, studio

from ..covering import others

SPHERE = clrt.Sphere(center=(0, 1, 0), radius=1, material=clrt.Diffuse(color=(0.8, 0.1, 0.1)))
GROUND = clrt.Ground(height=0, radius=5, color=(FLOOR_COLOR,) * 3)
#: The whole image is below the horizon.
ABOVE = clrt.Camera(position=(0, 6, 8), look_at=(0, 0.5, 0), fov_degrees=40)


def scene(**changes: Any) -> clrt.Scene:
    made = clrt.Scene(spheres=[SPHERE], ground=GROUND, environment=studio(), lights=[KEY], camera=ABOVE)
    return replace(made, **changes)


def rendered(of: clrt.Scene, **options: Any) -> clrt.Image:
    return clrt.render(of, **{"size": (48, 48), "spp": 64, **options})


def test_it_has_no_edge_far_from_the_model() -> None:
    """Without an object the picture is one grey, over the ground and beyond it."""
    pixels = rendered(scene(spheres=[]), spp=256).pixels
    assert np.abs(pixels - ROOM).max() < 0.03 * ROOM
    assert pixels.mean() == pytest.approx(ROOM, rel=2e-3)
    assert len(np.unique(pixels)) > 100  # the ground is in it


def test_it_catches_the_contact_shadow() -> None:
    shown, without = rendered(scene()).pixels, rendered(scene(ground=None)).pixels
    row = (shown - without).mean(axis=(1, 2))
    assert row.min() < -0.02  # darker under the sphere
    assert shown[:4].mean() == pytest.approx(ROOM, rel=0.02)


@pytest.mark.parametrize("integrator", ["normals", *others("albedo", "depth")])
def test_images_of_data_are_without_it(integrator: Any) -> None:
    one, other = (rendered(scene(ground=ground), spp=4, integrator=integrator) for ground in (GROUND, None))
    assert (one.pixels == other.pixels).all()


def test_a_transparent_image_has_its_shadow_in_alpha_alone() -> None:
    """The ground away from the shadow has an alpha of 0, the shadow one in between, the sphere 1."""
    alpha = rendered(scene(), transparent=True).alpha
    assert alpha is not None
    assert alpha[0].max() == 0 and alpha[24, 24] == 1
    beside = alpha[34:40]
    assert 0.05 < beside[beside < 0.99].max()


def test_a_backdrop_is_not_covered() -> None:
    image = rendered(scene(backdrop=clrt.Backdrop(color=(0.1, 0.5, 0.2))))
    np.testing.assert_allclose(image.pixels[0, 0], (0.1, 0.5, 0.2), rtol=1e-5)


@pytest.mark.parametrize("integrator", ["local", *others("raster")])
def test_integrators_without_catchers_render_transparent_images(integrator: Any) -> None:
    alpha = rendered(scene(), integrator=integrator, transparent=True, spp=1).alpha
    assert alpha is not None and set(alpha.ravel().tolist()) == {0.0, 1.0}


def test_a_camera_below_it_sees_the_model() -> None:
    """From a camera of a file, or one that a program turns to; it is there again above."""
    below = replace(ABOVE, position=(0, -3, 6))
    seen = rendered(scene(camera=below)).pixels
    assert (seen == rendered(scene(camera=below, ground=None)).pixels).all()
    renderer = clrt.Renderer(scene(), size=(16, 16), spp=1)
    for camera in (below, ABOVE, below):
        renderer.look(camera)
        *_, state = renderer.passes(spp=1)
        alone = clrt.render(scene(camera=camera), size=(16, 16), spp=1)
        assert (state.pixels == alone.pixels).all()
    renderer.show(scene())
    *_, state = renderer.passes(spp=1)
    assert (state.pixels == clrt.render(scene(), size=(16, 16), spp=1).pixels).all()


def test_frames_reuse_it() -> None:
    """Two frames of one scene have the identical mesh, for BVHs and buffers to be kept."""
    one, other = (on_ground(replace(scene(), camera=camera)) for camera in (ABOVE, replace(ABOVE, fov_degrees=20)))
    assert one.meshes[-1] is other.meshes[-1] and one.ground is None and len(scene().meshes) == 0


def test_a_turntable_of_the_object_shows_it_as_if_it_were_turned() -> None:
    """The camera's frame at 90 degrees equals a still of the sphere's scene with an off-center sphere turned back."""
    ball = clrt.Sphere(center=(1, 0.5, 0), radius=0.5)
    start = scene(spheres=[ball])
    frames = dict(clrt.frames(clrt.turntable(start, 4, turns="object")))
    turned = scene(spheres=[replace(ball, center=(0, 0.5, 1))])  # by -90 degrees about +Y
    one, other = rendered(frames[1], spp=256).pixels, rendered(turned, spp=256).pixels
    still = rendered(scene(spheres=[ball], camera=frames[1].camera), spp=256).pixels
    assert np.abs(one - other).mean() < 0.2 * np.abs(one - still).mean()


def test_what_cannot_turn_is_refused() -> None:
    tilted = scene(camera=replace(ABOVE, up=(0, 1, 1)))
    with pytest.raises(clrt.SceneError, match="turntable_turns: objects turn about .Y only"):
        next(clrt.frames(clrt.turntable(tilted, 4, turns="object")))
    with pytest.raises(clrt.UsageError, match="turns"):
        clrt.turntable(scene(), 4, turns="lights")  # type: ignore[arg-type]
