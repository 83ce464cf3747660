"""Driver of the window tests: ImGui's test engine operates the window, and screenshots are read back."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from imgui_bundle import hello_imgui, imgui
from imgui_bundle.immapp import testing
from numpy.typing import NDArray

from clrt.formats.images.image_reader import read_texels
from clrt.live.settings import Settings
from clrt.live.snapshot import Snapshot
from clrt.scene.model import Scene
from clrt.window.app import App

Levels = NDArray[np.int16]
#: Timeout in seconds of any action, on a busy machine.
PATIENCE = 60.0


class Driver:
    """Window under test. Items are named as in ImGui's test engine: PANEL/ITEM."""

    def __init__(self, app: App, context: imgui.test_engine.TestContext, folder: Path) -> None:
        self.app, self.live, self.context, self._folder = app, app.live, context, folder
        self._pictures = 0

    def until(self, holds: Callable[[], bool], what: str) -> None:
        """Run the window until the condition holds."""
        end = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < end, f"{what}: not in {PATIENCE:g} s"
            assert not self.context.is_error(), "the test engine missed something; its log is below"
            self.context.yield_()

    def rest(self) -> Snapshot:
        """Wait until the complete image of the last request is shown, and return its snapshot."""
        live, viewport = self.live, self.app.viewport

        def shown() -> bool:
            snapshot = live.snapshot()
            whole = snapshot.pixels.shape[1::-1] == snapshot.size and snapshot.spp >= snapshot.scene.render.spp
            done = whole and snapshot.phase == "rest" and snapshot.asked == live.asked
            return done and viewport.shown is not None and viewport.shown.snapshot.number == snapshot.number

        self.until(shown, "a picture at rest")
        self.context.yield_(2)
        return live.snapshot()

    def panel(self, name: str) -> None:
        """Bring a panel to the front; later items without a panel name refer to it."""
        self.context.window_focus(f"//{name}")
        self.context.set_ref(f"//{name}")

    def choose(self, item: str, choice: str) -> None:
        """Open a list and select one of its lines."""
        self.context.item_click(item)
        popup = self.context.get_window_by_ref("//$FOCUSED").name
        self.context.item_click(f"//{popup}/**/{choice}")

    def window(self) -> Levels:
        """Return a screenshot of the window, (height, width, 3), with the mouse moved away."""
        path = self._folder / f"{self._pictures:02}.png"
        self._pictures += 1
        self.context.mouse_move_to_pos((1, 1))
        self.context.yield_(2)
        self.app.editor.save_screenshot(path)
        self.until(path.exists, f"the screenshot {path}")
        return read_texels(path)[..., :3].astype(np.int16)

    def picture(self) -> Levels:
        """Return the part of the screenshot that shows the image."""
        (x, y), (width, height) = self.app.viewport.corner, self.app.viewport.size
        return self.window()[y : y + height, x : x + width]


def changed(before: Levels, after: Levels) -> NDArray[np.bool_]:
    """Return a mask, (height, width), of the pixels where two images differ by more than one level."""
    return np.asarray(np.abs(before - after).max(axis=2) > 1)


def halves(mask: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the fractions of the left and the right half that are set."""
    middle = mask.shape[1] // 2
    return float(mask[:, :middle].mean()), float(mask[:, middle:].mean())


def at(picture: Levels, x: float, y: float) -> list[int]:
    """Return the color at a point, given in the 160 x 120 rendered pixels."""
    height, width = picture.shape[:2]
    return [int(level) for level in picture[int(y / 120 * height), int(x / 160 * width)]]


def drive(scene: Scene, test: Callable[[Driver], None], folder: Path, settings: Settings = Settings()) -> None:
    """Open a window on the scene, run the test in it, and close it. Screenshots go to the folder."""
    app = App(scene, settings)
    app.params.ini_disable = True
    # The test engine treats this signal as a crash; Python ignores it and raises an error instead.
    app.params.callbacks.before_imgui_render = lambda: _ignore(signal.SIGPIPE)

    def run(context: imgui.test_engine.TestContext) -> None:
        engine = hello_imgui.get_imgui_test_engine()
        imgui.test_engine.get_io(engine).config_watchdog_kill_test = 10 * PATIENCE
        test(Driver(app, context, folder))

    app.run(partial(testing.run, test_function=run))


def _ignore(number: signal.Signals) -> None:
    signal.signal(number, signal.SIG_IGN)
