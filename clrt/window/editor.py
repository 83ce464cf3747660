"""State shared by the panels: the live session, the display settings, and the last message."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from math import tau
from pathlib import Path
from typing import Any, TypeVar

from imgui_bundle import imgui

from ..device.device_info import DeviceInfo
from ..errors import ClrtError, ObjectError, UsageError
from ..formats.load_scene import load
from ..live.live import Live
from ..live.picks import Thing
from ..live.settings import Settings
from ..live.snapshot import Snapshot
from ..output.atomic_files import check_unprotected
from ..output.images import write_image
from ..output.scenes import save_scene
from ..scene.editing import materials_of, with_material
from ..scene.materials.material import Material
from ..scene.model import Camera, Instance, Scene, Source, Sphere
from .camera_controls import CameraControls
from .fields import edit_fields
from .navigation import around, distance
from .screenshot import screenshot
from .tone_mapping import DisplaySettings, ToneMapper

_log = logging.getLogger(__name__)
Value = TypeVar("Value")
#: Titles of panels.
SPHERES, MATERIALS = "Spheres", "Materials"
#: Change of a coordinate per pixel of dragging, relative to the camera's distance.
STEP = 1 / 500
#: Period in seconds of a moving light's circle.
ROUND = 8.0


class Editor:
    """Scene editor. The scene and the settings are those of the session. message: the last error or success; frames:
    the number of frames drawn; moving_light: index of the light that circles around the camera's look_at point; sphere,
    material: index and name of those being edited."""

    def __init__(self, live: Live, look: DisplaySettings, devices: Sequence[DeviceInfo]) -> None:
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
        """The current scene, with all edits."""
        return self.live.scene

    @property
    def settings(self) -> Settings:
        """The current settings."""
        return self.live.settings

    @property
    def snapshot(self) -> Snapshot:
        """The newest image of the session."""
        return self.live.snapshot()

    @property
    def step(self) -> float:
        """Change of a coordinate per pixel of dragging."""
        return STEP * distance(self.scene.camera)

    @property
    def materials(self) -> dict[str, Material]:
        """The scene's materials by name (scene.editing)."""
        if self._materials is None or self._materials[0] is not self.scene:
            self._materials = self.scene, materials_of(self.scene)
        return self._materials[1]

    def edited(self, record: Value, without: Collection[str] = (), changed_copy: Callable[..., Any] = replace) -> Value:
        """Show widgets for the fields of an object (see `edit_fields`); it stays as it is, with a message, if its new
        values are invalid."""

        def tried(record: Value, **changed: Any) -> Value:
            try:
                made: Value = changed_copy(record, **changed)
                return made
            except ObjectError as problem:
                self.message = str(problem)
                return record

        return edit_fields(record, self.step, without, tried)

    def edit(self, **changes: Any) -> None:
        """Replace parts of the scene. A drag is a single undo step."""
        self._show(lambda: replace(self.scene, **changes))

    def repaint(self, old: Material, new: Material) -> None:
        """Replace a material everywhere."""
        self._show(lambda: with_material(self.scene, old, new))

    def walk(self, camera: Camera) -> None:
        """Move the camera, which is not an undo step."""
        self.attempt(lambda: self.live.edit(replace(self.scene, camera=camera), moving=True, step=False))

    def choose(self, settings: Settings) -> None:
        """Replace the settings."""
        self.attempt(lambda: self.live.choose(settings))

    def pick(self, x: float, y: float) -> None:
        """Select what is visible at a position of the image (see `Live.pick`) for editing, once it is known."""
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
        """Write the newest image as displayed (.png), or its linear radiance (.exr, .hdr)."""
        look = self.look
        self._write(path, lambda: self.live.image().save(path, view=look.view, exposure=look.exposure))

    def save_scene(self, path: Path) -> None:
        """Write the scene as a scene file, with the files that it refers to."""
        scene = self.scene
        self._write(path, lambda: save_scene(scene, path, force=False))

    def open(self, path: Path) -> None:
        """Replace the scene by the one in a file, which is an undo step."""
        self._beside(path, "is shown", lambda: self.live.edit(load(path)))

    def save_screenshot(self, path: Path) -> None:
        """Write a screenshot of the window at the end of this frame."""
        self._screenshot = path

    def take_screenshot(self) -> None:
        """Take the requested screenshot, if any; called at the end of a frame."""
        if self._screenshot is not None:
            path, pixels = self._screenshot, screenshot()
            self._screenshot = None
            self._write(path, lambda: write_image(path, pixels, view="raw"))

    def _write(self, path: Path, write: Callable[[], object]) -> None:
        """Write a file in the background; fails if that would replace a read-only file or one of the scene's."""
        source = self.scene.source or Source()

        def checked() -> None:
            if path.resolve() in {file.resolve() for file in source.paths}:
                raise UsageError(f"{path}: is a file of the scene, which would be lost; choose another file")
            check_unprotected(path, force=False)
            write()

        self._beside(path, "is written", checked)

    def _beside(self, path: Path, done: str, do: Callable[[], object]) -> None:
        """Run a file operation in the background. done: the message about the file on success."""

        def work() -> None:
            try:
                self.attempt(do)
                self.message = self.message or f"{path} {done}"
            except Exception as error:  # an internal error must not look like success
                _log.exception("%s failed", path)
                self.message = f"{path}: {type(error).__name__}: {error}"

        self._files.submit(work)

    def close(self) -> None:
        """Stop the threads, once files are written."""
        self._files.shutdown()
        self.tone_mapper.close()

    def attempt(self, do: Callable[[], object]) -> None:
        """Run an action, and show the message if it raises ClrtError."""
        try:
            do()
            self.message = ""
        except ClrtError as problem:
            self.message = str(problem)

    def frame(self) -> None:
        """Run the per-frame work, before the panels are drawn."""
        self.frames += 1
        self.tone_mapper.ask(self.snapshot, self.look)
        if self._dragging and not imgui.is_any_item_active():
            self._show(lambda: self.scene)
        self._choose_picked()
        self._move_light()
        if not imgui.get_io().want_text_input:
            self._shortcuts()

    def _shortcuts(self) -> None:
        if imgui.is_key_chord_pressed(imgui.Key.mod_ctrl | imgui.Key.z):
            self.live.undo()
        if imgui.is_key_chord_pressed(imgui.Key.mod_ctrl | imgui.Key.y):
            self.live.redo()

    def _show(self, edited: Callable[[], Scene]) -> None:
        self._dragging = imgui.is_any_item_active()
        self.attempt(lambda: self.live.edit(edited(), moving=self._dragging))

    def _move_light(self) -> None:
        lights = list(self.scene.lights)
        if self.moving_light is None or self.moving_light >= len(lights):
            return
        light = lights[self.moving_light]
        position = getattr(light, "position", None)
        if position is not None:
            turn = tau * imgui.get_io().delta_time / ROUND
            moved: dict[str, Any] = {"position": around(position, self.scene.camera, turn)}
            lights[self.moving_light] = replace(light, **moved)
            self.attempt(lambda: self.live.edit(replace(self.scene, lights=lights), moving=True, step=False))


def _bring_forward(panel: str) -> None:
    """Select a panel's tab. The keyboard focus stays with the viewport, so the panel is not focused itself."""
    window = imgui.internal.find_window_by_name(panel)
    if window.dock_node is not None and window.dock_node.tab_bar is not None:
        window.dock_node.tab_bar.next_selected_tab_id = window.tab_id
