"""Warnings about faulty images: each is logged once and listed once in the report; other images have none."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Environment, Scene, Sphere

from .pictures import quad

LAMP = Diffuse(emission=(4.0, 4.0, 4.0))
BALL = Scene(spheres=[Sphere()], lights=[PointLight(position=(0, 4, 4), intensity=(9, 9, 9))], name="ball")
UPWARDS = quad([(-1, 3, 1), (1, 3, 1), (1, 3, -1), (-1, 3, -1)], LAMP)
DEBUG = "; `clrt debug SCENE --pixel 4,3` shows why"
DROPPED = (
    "were not finite and were dropped, so the image may be too dark; look for extreme values in lights, "
    "textures and materials"
)


def said(device: Device, caplog: pytest.LogCaptureFixture, scene: Scene, **options: Any) -> list[str]:
    """Return the warnings of a report, after checking that they are those of the log."""
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        report = clrt.render(scene, device=device.info.index, size=(8, 6), spp=4, **options).report
    assert sorted(caplog.messages) == sorted(f"{scene.name}: {text}" for text in report["warnings"])
    return list(report["warnings"])


@pytest.mark.programs
def test_a_picture_that_is_right_says_nothing(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    for integrator in ("path", "local", "normals"):
        assert said(device, caplog, BALL, integrator=integrator) == []


@pytest.mark.parametrize(
    "scene, options, reason",
    [
        (
            replace(BALL, camera=Camera(position=(0, 0, 5), look_at=(0, 0, 9))),
            {},
            "camera rays hit nothing, or only surfaces that reflect nothing",
        ),
        (
            replace(BALL, lights=[PointLight(position=(0, 0, 0), intensity=(9, 9, 9))]),
            {},
            "no light reaches what the camera sees",
        ),
        (BALL, {"max_depth": 1}, "max_depth is 1, which shows emission alone, and the camera sees no emitter"),
        (
            replace(BALL, lights=[], environment=Environment(color=(2.0**-15,) * 3), spheres=[]),
            {},
            "its brightest value is 3.1e-05; --exposure 14 makes it visible",
        ),
    ],
    ids=["away", "shadow", "depth", "dim"],
)
def test_a_black_picture_says_why(
    device: Device, caplog: pytest.LogCaptureFixture, scene: Scene, options: dict[str, Any], reason: str
) -> None:
    assert said(device, caplog, scene, **options) == [f"the image is black: {reason}{DEBUG}"]
    assert said(device, caplog, scene, integrator="depth") == []


@pytest.mark.programs
def test_a_lamp_that_is_wound_backwards(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    """It is reported before the render, and as the cause of the black image."""
    scene = replace(BALL, lights=[], meshes=[UPWARDS])
    found = said(device, caplog, scene)
    assert [text.split(";")[0] for text in found] == [
        'the emissive mesh "mesh" emits light only away from the scene',
        'the image is black: "mesh" emits light only away from the scene',
    ]
    assert said(device, caplog, replace(scene, lights=BALL.lights))[1:] == []
    turned = replace(UPWARDS, faces=UPWARDS.faces[:, ::-1].copy())
    assert said(device, caplog, replace(scene, meshes=[turned])) == []


def test_only_integrators_that_clrt_debug_follows_point_to_it(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    away = replace(BALL, camera=Camera(position=(0, 0, 5), look_at=(0, 0, 9)))
    assert all(not text.endswith(DEBUG) for text in said(device, caplog, away, integrator="local"))


def test_samples_that_are_not_finite(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    """An environment texel beyond the film's range: dropped samples are counted, and named as
    the cause if all are lost.
    """
    sky = np.ones((2, 4, 3), np.float32)
    sky[0, 0] = 1e35
    some = said(
        device,
        caplog,
        Scene(environment=Environment(image=sky), name="sky", camera=Camera(projection="equirectangular")),
    )
    assert len(some) == 1 and some[0].endswith(DROPPED)
    dropped, samples = (int(word) for word in some[0].split() if word.isdigit())
    assert 0 < dropped < samples == 8 * 6 * 4
    assert said(device, caplog, Scene(environment=Environment(color=(1e35, 1.0, 1.0)), name="sky")) == [
        f"192 of 192 samples {DROPPED}",
        f"the image is black: none of its samples is finite{DEBUG}",
    ]


def test_a_scene_without_light_says_so_once(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    assert said(device, caplog, replace(BALL, lights=[])) == ["the image is black: nothing in this scene emits light"]
