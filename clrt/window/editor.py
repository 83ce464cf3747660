"""What the panels share: the live session, how its picture is shown, and a place for complaints."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from math import tau
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from ..device.describe import DeviceInfo
from ..errors import ClrtError, UsageError
from ..live.live import Live
from ..live.picks import Thing
from ..live.settings import Settings
from ..live.snapshot import Snapshot
from ..output.files import check_unprotected
from ..output.images import write_image
from ..output.scenes import save_scene
from ..scene.editing import materials_of, with_material
from ..scene.file import load
from ..scene.lights import DirectionalLight
from ..scene.material import Material
from ..scene.model import Camera, Instance, Scene, Sphere
from ..scene.source import Source
from .camera_controls import CameraControls
from .navigation import around, distance
from .screenshot import screenshot
from .tone_mapping import Look, ToneMapper

_log = logging.getLogger(__name__)
#: Panels, by their titles.
SPHERES, MATERIALS = "Spheres", "Materials"
#: What a pixel of dragging a coordinate moves, over the camera's distance.
STEP = 1 / 500
#: Seconds that a moving light takes for its circle.
ROUND = 8.0


class Editor:
    """The scene and the settings are the session's own. message: what could not be done last, or was done; frames: how
    many were drawn; moving_light: the number of the one that circles round what the camera looks at; sphere, material:
    the number and the name of those that the panels edit."""

    def __init__(self, live: Live, look: Look, devices: Sequence[DeviceInfo]) -> None:
        self.live, self.look, self.devices = live, look, devices
        self.tone_mapper, self.controls = ToneMapper(), CameraControls()
        self.message, self.frames = "", 0
        self.moving_light: int | None = None
        self.sphere, self.material = 0, ""
        self._picked: Future[Thing | None] | None = None
        self._dragging = False
        self._screenshot: Path | None = None
        self._files = ThreadPoolExecutor(1, "clrt files")
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

    def pick(self, x: float, y: float) -> None:
        """Has the panels edit what is seen at a place of the picture (see `Live.pick`), once that is known."""
        self._picked = self.live.pick(x, y)

    def _choose_picked(self) -> None:
        if self._picked is None or not self._picked.done():
            return
        picked, self._picked = self._picked, None
        self.attempt(lambda: self._choose(picked.result()))

    def _choose(self, thing: Thing | None) -> None:
        if thing is None:
            return
        if isinstance(thing, Sphere):
            self.sphere = next((i for i, each in enumerate(self.scene.spheres) if each is thing), self.sphere)
        material = thing.material or thing.mesh.material if isinstance(thing, Instance) else thing.material
        self.material = next((name for name, each in self.materials.items() if each is material), self.material)
        if imgui.internal.find_window_by_name(MATERIALS).hidden:
            _bring_forward(SPHERES if isinstance(thing, Sphere) else MATERIALS)

    def save_picture(self, path: Path) -> None:
        """Writes the newest picture as it is shown (.png), or its light (.exr, .hdr)."""
        look = self.look
        self._write(path, lambda: self.live.image().save(path, view=look.view, exposure=look.exposure))

    def save_scene(self, path: Path) -> None:
        """Writes the scene as a scene file, with what belongs beside it."""
        scene = self.scene
        self._write(path, lambda: save_scene(scene, path, force=False))

    def open(self, path: Path) -> None:
        """Shows the scene in a file instead, which is a step of undoing."""
        self._beside(path, "is shown", lambda: self.live.edit(load(path)))

    def save_screenshot(self, path: Path) -> None:
        """Writes the window as it looks, once this frame is drawn."""
        self._screenshot = path

    def take_screenshot(self) -> None:
        """Does so, at the end of a frame."""
        if self._screenshot is not None:
            path, pixels = self._screenshot, screenshot()
            self._screenshot = None
            self._write(path, lambda: write_image(path, pixels, view="raw"))

    def _write(self, path: Path, write: Callable[[], object]) -> None:
        """Writes a file without waiting for it, unless that would replace one that is read-only or of the scene."""
        source = self.scene.source or Source()

        def checked() -> None:
            if path.resolve() in {file.resolve() for file in source.paths}:
                raise UsageError(f"{path}: is a file of the scene, which would be lost; name another file")
            check_unprotected(path, force=False)
            write()

        self._beside(path, "is written", checked)

    def _beside(self, path: Path, done: str, do: Callable[[], object]) -> None:
        """Does something with a file without waiting for it. done: what is said of the file then."""
        def work() -> None:
            try:
                self.attempt(do)
                self.message = self.message or f"{path} {done}"
            except Exception as error:  # a mistake of ours must not pass for success
                _log.exception("%s failed", path)
                self.message = f"{path}: {type(error).__name__}: {error}"

        self._files.submit(work)

    def close(self) -> None:
        """Ends its threads, once files are written."""
        self._files.shutdown()
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
        self._choose_picked()
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


def _bring_forward(panel: str) -> None:
    """Selects a panel's tab. The keyboard stays with the picture, which giving the panel the focus would not allow."""
    window = imgui.internal.find_window_by_name(panel)
    if window.dock_node is not None and window.dock_node.tab_bar is not None:
        window.dock_node.tab_bar.next_selected_tab_id = window.tab_id
