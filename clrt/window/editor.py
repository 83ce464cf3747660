"""What the panels share: the live session, how its picture is shown, and a place for complaints."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from math import tau
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from ..device.describe import DeviceInfo
from ..errors import ClrtError
from ..live.live import Live
from ..live.settings import Settings
from ..live.snapshot import Snapshot
from ..output.images import write_image
from ..output.scenes import save_scene
from ..scene.editing import materials_of, with_material
from ..scene.lights import DirectionalLight
from ..scene.material import Material
from ..scene.model import Camera, Scene
from .camera_controls import CameraControls
from .navigation import around, distance
from .screenshot import screenshot
from .tone_mapping import Look, ToneMapper

_log = logging.getLogger(__name__)
#: What a pixel of dragging a coordinate moves, over the camera's distance.
STEP = 1 / 500
#: Seconds that a moving light takes for its circle.
ROUND = 8.0


class Editor:
    """The scene and the settings are the session's own. message: what could not be done last, or was done; frames: how
    many were drawn; moving_light: the number of the one that circles round what the camera looks at."""

    def __init__(self, live: Live, look: Look, devices: Sequence[DeviceInfo]) -> None:
        self.live, self.look, self.devices = live, look, devices
        self.tone_mapper, self.controls = ToneMapper(), CameraControls()
        self.message, self.frames = "", 0
        self.moving_light: int | None = None
        self._dragging = False
        self._screenshot: Path | None = None
        self._writer = ThreadPoolExecutor(1, "clrt writes")
        self._materials: tuple[Scene, dict[str, Material]] | None = None

    @property
    def scene(self) -> Scene:
        """The newest scene, with all edits."""
        return self.live.scene

    @property
    def settings(self) -> Settings:
        """The newest settings."""
        return self.live.settings

    @property
    def snapshot(self) -> Snapshot:
        """The newest picture."""
        return self.live.snapshot()

    @property
    def step(self) -> float:
        """What a pixel of dragging changes in a coordinate."""
        return STEP * distance(self.scene.camera)

    @property
    def materials(self) -> dict[str, Material]:
        """The scene's by name (scene.editing)."""
        if self._materials is None or self._materials[0] is not self.scene:
            self._materials = self.scene, materials_of(self.scene)
        return self._materials[1]

    def edit(self, **changes: Any) -> None:
        """Replaces parts of the scene. What is dragged is one step of undoing."""
        self._show(replace(self.scene, **changes))

    def repaint(self, old: Material, new: Material) -> None:
        """Replaces a material wherever it is."""
        self._show(with_material(self.scene, old, new))

    def walk(self, camera: Camera) -> None:
        """Moves the camera, which is no step of undoing."""
        self.attempt(lambda: self.live.edit(replace(self.scene, camera=camera), moving=True, step=False))

    def choose(self, settings: Settings) -> None:
        """Replaces the settings."""
        self.attempt(lambda: self.live.choose(settings))

    def save_picture(self, path: Path) -> None:
        """Writes the newest whole picture as it is shown (.png), or its light (.exr, .hdr)."""
        look = self.look
        self._save(path, lambda: self.live.image().save(path, view=look.view, exposure=look.exposure))

    def save_scene(self, path: Path) -> None:
        """Writes the scene as a scene file, with what belongs beside it."""
        scene = self.scene
        self._save(path, lambda: save_scene(scene, path))

    def save_screenshot(self, path: Path) -> None:
        """Writes the window as it looks, once this frame is drawn."""
        self._screenshot = path

    def take_screenshot(self) -> None:
        """Does so, at the end of a frame."""
        if self._screenshot is not None:
            path, pixels = self._screenshot, screenshot()
            self._screenshot = None
            self._save(path, lambda: write_image(path, pixels, view="raw"))

    def _save(self, path: Path, write: Callable[[], object]) -> None:
        """Has a file written without waiting for it."""
        def work() -> None:
            try:
                self.attempt(write)
                self.message = self.message or f"{path} is written"
            except Exception as error:  # a mistake of ours must not pass for a file
                _log.exception("%s was not written", path)
                self.message = f"{path}: {type(error).__name__}: {error}"

        self._writer.submit(work)

    def close(self) -> None:
        """Ends its threads, once files are written."""
        self._writer.shutdown()
        self.tone_mapper.close()

    def attempt(self, do: Callable[[], object]) -> None:
        """Does something that may be refused; says why if it is."""
        try:
            do()
            self.message = ""
        except ClrtError as problem:
            self.message = str(problem)

    def frame(self) -> None:
        """What is to be done in every frame, before the panels are drawn."""
        self.frames += 1
        self.tone_mapper.ask(self.snapshot, self.look)
        if self._dragging and not imgui.is_any_item_active():
            self._show(self.scene)
        self._move_light()
        if not imgui.get_io().want_text_input:
            self._shortcuts()

    def _shortcuts(self) -> None:
        if imgui.is_key_chord_pressed(imgui.Key.mod_ctrl | imgui.Key.z):
            self.live.undo()
        if imgui.is_key_chord_pressed(imgui.Key.mod_ctrl | imgui.Key.y):
            self.live.redo()

    def _show(self, scene: Scene) -> None:
        self._dragging = imgui.is_any_item_active()
        self.attempt(lambda: self.live.edit(scene, moving=self._dragging))

    def _move_light(self) -> None:
        lights = list(self.scene.lights)
        if self.moving_light is None or self.moving_light >= len(lights):
            return
        light = lights[self.moving_light]
        if not isinstance(light, DirectionalLight):
            turn = tau * imgui.get_io().delta_time / ROUND
            lights[self.moving_light] = replace(light, position=around(light.position, self.scene.camera, turn))
            self.attempt(lambda: self.live.edit(replace(self.scene, lights=lights), moving=True, step=False))
