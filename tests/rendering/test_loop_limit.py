"""Drivers that end loops early: results of ended loops are never accepted as an image or a hit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.device_info import Paths
from clrt.device.launches.driver_loop_limits import loop_turns, measured_turns
from clrt.device.open import Device
from clrt.device.programs import program
from clrt.errors import DeviceError
from clrt.queries.mesh import RayQuery
from clrt.rendering.accumulation import checked_loops
from clrt.rendering.accumulation.accumulation import Accumulation
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.rendering.accumulation.first_hits import first_hits
from clrt.rendering.accumulation.work_queue import WorkPart, WorkQueue
from clrt.rendering.compile import compile_scene as compiling
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Mesh, Scene

from ..check.sabotage import sabotaged

SIZE, SPP = (16, 24), 8


def shining_ball(rows: int) -> Mesh:
    """Return a closed emissive sphere seen from inside, with radiance 0.01 everywhere and albedo 1."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, 2 * rows + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.stack([a, c, b, a, d, c], axis=2).reshape(-1, 3).astype(np.float32)
    faces = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    p0, p1, p2 = corners[faces].transpose(1, 0, 2)
    flat = np.linalg.norm(np.cross(p1 - p0, p2 - p0), axis=1) < 1e-6
    return Mesh(corners, faces[~flat], Diffuse(color=(1.0, 1.0, 1.0), emission=(0.01, 0.01, 0.01)))


def scene(rows: int = 3) -> Scene:
    """Return a scene whose image at depth d is 0.01 d."""
    return Scene(
        meshes=[shining_ball(rows)], camera=Camera(position=(0.1, 0.2, 0.3), look_at=(0.0, -0.1, -1.0), fov_degrees=70)
    )


def picture(
    device: Device, depth: int = 6, rows: int = 3, spp: int = SPP, paths: Paths | None = None
) -> NDArray[np.float32]:
    renderer = Renderer(scene(rows), device=device.info.id, size=SIZE, max_depth=depth, layout="list", paths=paths)
    *_, state = renderer.passes(spp=spp)
    return state.pixels


def limit(patch: pytest.MonkeyPatch, turns: int) -> None:
    """Has the renderer believe that the device's driver ends loops after so many turns."""
    for module in (compiling, checked_loops):
        patch.setattr(module, "loop_turns", lambda device: turns)


def test_a_limit_is_found_where_there_is_one(device: Device) -> None:
    assert measured_turns(device) == loop_turns(device)


@pytest.mark.programs
@pytest.mark.parametrize(("turns", "paths"), [(1, None), (30_000, None), (30_000, "queues"), (100_000, None)])
def test_short_launches_change_nothing(
    device: Device, turns: int, paths: Paths | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = picture(device, paths=paths)
    limit(monkeypatch, turns)
    launched = list[WorkPart]()

    def cut(
        *arguments: Any, original: Callable[..., WorkPart | None] = WorkQueue.cut, **limits: Any
    ) -> WorkPart | None:
        part = original(*arguments, **limits)
        launched.extend([part] if part else [])
        return part

    monkeypatch.setattr(WorkQueue, "cut", cut)
    assert np.array_equal(picture(device, paths=paths), whole)
    most = max(part.more for part in launched)
    # A path vertex traces two rays, each testing the whole list: 6 rows of 6 quads, less a triangle at the poles.
    assert most == 1 or 2 * 6 * 30 * most < turns


def test_work_is_shortened_in_order() -> None:
    work = WorkQueue(np.zeros((1, 3), np.int64))
    work.take(np.arange(3), [WorkPart(0, 3, 0, 7)])
    done = []
    while work.parts:
        done.append(work.cut(100, 2, most_tiles=2, most_samples=3))
    work.settle()
    assert done == [
        WorkPart(0, 2, 0, 3),
        WorkPart(2, 3, 0, 3),
        WorkPart(0, 2, 3, 3),
        WorkPart(2, 3, 3, 3),
        WorkPart(0, 2, 6, 1),
        WorkPart(2, 3, 6, 1),
    ]
    assert work.samples.tolist() == [[7, 7, 7]]


@pytest.mark.programs
@pytest.mark.parametrize(("paths", "missed"), [(None, r"(77|8\d)"), ("queues", r"384")])
def test_samples_that_were_ended_are_missed(
    device: Device, paths: Paths | None, missed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kernels are changed as if the loops of every fifth pixel had been ended, or of every fifth entry of a queue:
    launches of queues store all of their samples or none."""
    limit(monkeypatch, 50_000)
    folder = sabotaged(tmp_path / "kernels", r"return a != 31;", "return a != 31 || get_global_id(0) % 5 == 0;")
    monkeypatch.setattr(program, "kernel_folder", lambda: folder)
    with pytest.raises(DeviceError, match=rf"after 50000 iterations, and {missed} of 384 samples .* need more"):
        picture(device, paths=paths)


@pytest.mark.programs
def test_too_many_turns_are_refused(device: Device) -> None:
    """A path of depth 1024 with a long list; without a limit, all of its light arrives."""
    if loop_turns(device) is None:
        assert abs(picture(device, 1024, 12, spp=1).mean() / 10.24 - 1) < 0.01
    else:
        with pytest.raises(DeviceError, match="need more"):
            picture(device, 1024, 12, spp=1)


def test_too_long_lists_are_refused(device: Device) -> None:
    triangles = np.zeros((100_000, 3, 3), np.float32)
    triangles += np.arange(100_000, dtype=np.float32)[:, None, None] / 64 + np.eye(3, dtype=np.float32)
    query = RayQuery(
        triangles.reshape(-1, 3),
        np.arange(300_000, dtype=np.int32).reshape(-1, 3),
        device=device.info.id,
        layout="list",
    )
    rays = [(-1.0, -1.0, -1.0), (3000.0, 0.0, 0.0)], [(1.0, 1.0, 1.0), (0.0, 1.0, 0.0)]
    if loop_turns(device) is None:
        assert query.closest_hit(*rays)["primitive"].tolist() == [0, -1]
        assert query.any_hit(*rays).tolist() == [True, False]
    else:
        for ask in (query.closest_hit, query.any_hit):
            with pytest.raises(DeviceError, match="rays need more in the layout list"):
                ask(*rays)


@pytest.mark.combinations
@pytest.mark.parametrize("entry", ["guides", "first_hit"])
def test_pixels_that_were_ended_are_missed(
    device: Device, entry: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit(monkeypatch, 50_000)
    render: dict[str, Callable[[Accumulation], dict[str, Any]]] = {
        "guides": render_guides,
        "first_hit": lambda session: first_hits(session, scene(), ["normal", "depth"]),
    }
    seen = render[entry](Renderer(scene(), device=device.info.id, size=SIZE).session)
    assert all(np.isfinite(picture).all() for picture in seen.values())
    folder = sabotaged(tmp_path / "kernels", r"return a != 31;", "return a != 31 || get_global_id(0) % 5 == 0;")
    monkeypatch.setattr(program, "kernel_folder", lambda: folder)
    with pytest.raises(DeviceError, match=r"after 50000 iterations, and (77|8\d) of 384 pixels .* need more"):
        render[entry](Renderer(scene(), device=device.info.id, size=SIZE).session)
