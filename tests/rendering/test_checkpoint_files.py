"""Checkpoint files: unusable ones are rejected, and the intact generation is found."""

from __future__ import annotations

import hashlib
import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.errors import CheckpointError
from clrt.rendering.checkpoint.checkpoint_file import MAGIC, older, read_checkpoint
from clrt.rendering.checkpoint.saved_state import KINDS
from clrt.scene.materials.material_types import Diffuse

from .checkpoints import SIZE, renderer, run, same
from .test_noise import room


@pytest.fixture(scope="module")
def generations(device: Device, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """Return a checkpoint of 24 samples per pixel, and the previous one of 16."""
    path = tmp_path_factory.mktemp("kept") / "a.ck"
    running = renderer(device, checkpoint=path, checkpoint_seconds=1e9)
    run(running, spp=16)
    run(running, spp=24)
    return path.read_bytes(), older(path).read_bytes()


@pytest.fixture
def kept(generations: tuple[bytes, bytes], tmp_path: Path) -> Path:
    """Write both generations and return the path."""
    path = tmp_path / "a.ck"
    path.write_bytes(generations[0])
    older(path).write_bytes(generations[1])
    return path


def test_a_render_that_ended_stays_as_it_is(device: Device, kept: Path) -> None:
    """The same stop conditions of any kind add no samples and yield the last state."""
    content = kept.read_bytes()
    first = renderer(device, checkpoint=kept, resume=True)
    assert (run(first, spp=24).spp, first.stop_reason) == (24, "spp")
    assert (run(first, time=first.seconds).spp, first.stop_reason) == (24, "time")
    noise = run(first, spp=1).noise
    assert noise is not None and (run(first, error=noise).spp, first.stop_reason) == (24, "error")
    assert kept.read_bytes() == content


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(content))) if rng.random() < 0.5 else int(rng.integers(600))
    return content[:at] + bytes([content[at] ^ 1 << int(rng.integers(8))]) + content[at + 1 :]


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content)))]


def _longer(content: bytes, rng: np.random.Generator) -> bytes:
    return content + rng.bytes(int(rng.integers(1, 99)))


def _noise(content: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(int(rng.integers(1, 9999)))


def _other_version(content: bytes, rng: np.random.Generator) -> bytes:
    return content.replace(MAGIC, b"clrt checkpoint 0\n", 1)


@pytest.mark.parametrize("damage", [_flipped, _cut, _longer, _noise, _other_version])
def test_damage_is_found(device: Device, kept: Path, caplog: pytest.LogCaptureFixture, damage: Any) -> None:
    """In 200 trials the older generation is used with a warning; if it is damaged too, the error says what to do."""
    rng, content = np.random.default_rng(4), kept.read_bytes()
    checkpoints = renderer(device, checkpoint=kept, resume=True)._checkpoints
    assert checkpoints is not None
    for _ in range(200):
        kept.write_bytes(damage(content, rng))
        caplog.clear()
        found = checkpoints.read(SIZE)
        assert found is not None and np.all(found.work.samples == 16)
        assert str(kept) in caplog.text and "older" in caplog.text
    whole = older(kept).read_bytes()
    for _ in range(20):
        older(kept).write_bytes(damage(whole, rng))
        with pytest.raises(CheckpointError, match="leave out --resume|remove it first"):
            checkpoints.read(SIZE)


def test_the_whole_generation_outlives_the_damaged_one(device: Device, kept: Path) -> None:
    """An intact generation is not replaced by an unreadable file, and is found if a crash left only it."""
    whole = older(kept).read_bytes()
    kept.write_bytes(b"damaged")
    running = renderer(device, checkpoint=kept, resume=True, checkpoint_seconds=60.0)  # so only at its end
    run(running, spp=24)
    assert older(kept).read_bytes() == whole and same(running, renderer(device, checkpoint=kept, resume=True))
    kept.unlink()
    assert run(renderer(device, checkpoint=kept, resume=True), spp=16).spp == 16


@pytest.mark.parametrize(
    "changes",
    [
        {"planned_spp": -1},
        {"planned_spp": 1.5},
        {"seconds": -1.0},
        {"seconds": "1"},
        {"seconds": None},
        {"facts": []},
        {"film": np.zeros((44, 60), KINDS["film"])},
        {"samples": np.full((6, 8), -1)},
        {"then": np.zeros((6, 8), np.int64)},
        {"then": np.full((6, 8), 1 << 62)},
        {"tiles": np.array([48], np.uint32)},
        {"tiles": np.zeros((1, 1), np.uint32)},
        {"parts": np.array([[0, 99, 24, 1]])},
        {"parts": np.zeros((1, 4), np.int64)},
        {"parts": np.zeros((3,), np.int64)},
        {"noise_level": np.full((6, 8), 60)},
        {"noise_level": np.zeros((0, 0), np.int64)},
        {"noise_mean": np.zeros((0, 0, 3), np.float32)},
        {"noise_changes": np.zeros((5, 2, 8, 6))},
        {"history": np.full((1, 4), np.nan)},
        {"history": np.zeros((4,))},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_what_does_not_fit_is_damage(device: Device, kept: Path, changes: dict[str, Any]) -> None:
    """Sizes and numbers are validated even if the checksum is right."""
    header, arrays = read_checkpoint(kept, KINDS)
    older(kept).unlink()
    _rewrite(
        kept,
        {**header, **{name: value for name, value in changes.items() if name not in arrays}},
        {name: changes.get(name, array) for name, array in arrays.items()},
    )
    with pytest.raises(CheckpointError, match="damaged"):
        renderer(device, checkpoint=kept, resume=True)


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"[]",
        b"{}",
        b'{"header": 3, "shapes": 4}',
        b"[" * 9000,
        b"1" * 9000,
        b'{"header": {}, "shapes": {"film": [1e999]}}',
        b"\xff",
        b"x" * 99999,
    ],
    ids=repr,
)
def test_headers_that_are_none(device: Device, kept: Path, line: bytes) -> None:
    older(kept).unlink()
    kept.write_bytes(MAGIC + line + b"\n" + hashlib.sha256(MAGIC + line + b"\n").digest())
    with pytest.raises(CheckpointError, match="damaged"):
        renderer(device, checkpoint=kept, resume=True)


def test_shapes_ask_for_no_more_memory_than_the_file_fills(device: Device, kept: Path) -> None:
    header, arrays = read_checkpoint(kept, KINDS)
    shapes = {name: [1 << 39, 1 << 39, 1 << 39] for name in arrays}
    older(kept).unlink()
    kept.write_bytes(MAGIC + json.dumps({"header": header, "shapes": shapes}).encode() + b"\n" + bytes(999))
    with pytest.raises(CheckpointError, match="bytes long"):
        renderer(device, checkpoint=kept, resume=True)


def _rewrite(path: Path, header: dict[str, Any], arrays: dict[str, Any]) -> None:
    """Write the file by the documented format, with independent code."""
    shapes = {name: list(array.shape) for name, array in arrays.items()}
    content = MAGIC + json.dumps({"header": header, "shapes": shapes}).encode() + b"\n"
    content += b"".join(array.tobytes() for array in arrays.values())
    path.write_bytes(content + hashlib.sha256(content).digest())


@pytest.mark.parametrize(
    "other, named",
    [
        ({"clamp_direct": 2.0}, "clamp_direct 0.0 instead of 2.0"),
        ({"clamp_indirect": 0.5}, "clamp_indirect 0.0 instead"),
        ({"back_face_culling": "all"}, "back_face_culling none instead of all"),
        ({"seed": 2}, "seed 1 instead of 2"),
        ({"size": (44, 61)}, "size 61x44 instead of 44x61"),
        ({"max_depth": 2}, "max_depth"),
        ({"integrator": "direct"}, "integrator"),
        ({"filter": "tent"}, "filter"),
        ({"sampler": "independent"}, "sampler"),
        ({"adaptive": True}, "adaptive False instead of True"),
        ({"triangle": "moller_trumbore"}, "triangle"),
        ({"offset": "ulp"}, "offset"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_other_settings_are_refused(device: Device, kept: Path, other: dict[str, Any], named: str) -> None:
    with pytest.raises(CheckpointError) as refused:
        renderer(device, checkpoint=kept, resume=True, **other)
    assert named in str(refused.value) and str(kept) in str(refused.value) and "--resume" in str(refused.value)


@pytest.mark.programs
def test_a_film_with_or_without_direct_light_is_refused(device: Device, kept: Path, tmp_path: Path) -> None:
    """The message names the option that enables it."""
    with pytest.raises(CheckpointError, match=r"another render \(without --aov direct or indirect\)"):
        renderer(device, checkpoint=kept, resume=True, aovs="indirect")
    run(renderer(device, checkpoint=tmp_path / "b.ck", aovs="direct"), spp=1)
    with pytest.raises(CheckpointError, match=r"another render \(with --aov direct or indirect\)"):
        renderer(device, checkpoint=tmp_path / "b.ck", resume=True)


@pytest.mark.parametrize("resume", [False, True])
def test_a_file_that_is_no_checkpoint_is_kept(device: Device, tmp_path: Path, resume: bool) -> None:
    """The message does not advise to start afresh, as that would be rejected, too."""
    (tmp_path / "a.ck").write_text("a letter")
    with pytest.raises(CheckpointError, match="is not a checkpoint, so it is not replaced; choose another file"):
        renderer(device, checkpoint=tmp_path / "a.ck", resume=resume)
    assert (tmp_path / "a.ck").read_text() == "a letter"


def test_other_scenes_and_kernels_are_refused(device: Device, kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each part of a scene that changed is named in the error; changed names are not."""
    scene = room()
    mesh, *others = scene.meshes
    moved = replace(mesh, vertices=mesh.vertices + np.float32(1e-6))
    for changed, named in [
        (replace(scene, camera=replace(scene.camera, fov_degrees=41.0)), "different camera"),
        (replace(scene, meshes=[moved, *others]), "different meshes"),
        (replace(scene, meshes=[replace(mesh, material=Diffuse(color=(0.1, 0.2, 0.3))), *others]), "different meshes"),
        (replace(scene, environment=replace(scene.environment, strength=2.0)), "different environment"),
    ]:
        with pytest.raises(CheckpointError, match=rf"another render \({named}\)"):
            renderer(device, changed, checkpoint=kept, resume=True)
    renamed = replace(scene, name="x", meshes=[replace(mesh, name="y"), *others])
    renderer(device, renamed, checkpoint=kept, resume=True, spp=100)
    for digest, named in [("kernel_digest", "different kernels"), ("code_digest", "different code")]:
        with monkeypatch.context() as patch, pytest.raises(CheckpointError, match=rf"another render \({named}\)"):
            patch.setattr(f"clrt.rendering.checkpoint.identity.{digest}", lambda: "0" * 64)
            renderer(device, checkpoint=kept, resume=True)


def test_a_checkpoint_of_an_older_release_is_refused(device: Device, kept: Path) -> None:
    """Also one from before the code counted: it lacks that fact."""
    header, arrays = read_checkpoint(kept, KINDS)
    facts = {name: value for name, value in header["facts"].items() if name != "code"}
    release = {**header["facts"], "version": "0.0.1"}
    for changed, named in [(facts, "different code"), (release, "version 0.0.1 instead of")]:
        _rewrite(kept, {**header, "facts": changed}, arrays)
        with pytest.raises(CheckpointError, match=named):
            renderer(device, checkpoint=kept, resume=True)


def test_device_is_told_where_it_is_another(device: Device, kept: Path, caplog: pytest.LogCaptureFixture) -> None:
    header, arrays = read_checkpoint(kept, KINDS)
    _rewrite(kept, {**header, "device": "Babbage"}, arrays)
    with caplog.at_level(logging.WARNING):
        renderer(device, checkpoint=kept, resume=True)
    assert "Babbage" in caplog.text and device.info.name in caplog.text
