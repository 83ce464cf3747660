"""The application window: its panel layout and per-frame callbacks, drawn with Dear ImGui (imgui-bundle)."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import hello_imgui, imgui, immapp

from ..device.discovery.discover import find_devices
from ..live.live import Live
from ..live.settings import Settings
from ..scene.model import Scene
from .editor import MATERIALS, SPHERES, Editor
from .needs import no_display
from .panels import materials, render, spheres, statistics
from .panels.camera import CameraPanel
from .panels.files import Files
from .panels.lights import Lights
from .tone_mapping import DisplaySettings as DisplaySettings
from .viewport import Viewport

SIZE = (1280, 800)
#: Frames per second: the maximum, and while idle.
FASTEST, IDLE = 60.0, 20.0
ADD_ONS = immapp.AddOnsParams(with_implot=True)


class App:
    """A window on a live session of its own. `params`: the parameters of Dear ImGui's runner."""

    def __init__(
        self, scene: Scene, settings: Settings = Settings(), look: DisplaySettings = DisplaySettings()
    ) -> None:
        # Before OpenGL is loaded: libraries loaded later would get Mesa's LLVM, and PoCL aborts with a foreign one.
        devices = [info for info, _ in find_devices() if info.usable]
        self.live = Live(scene, settings=settings)
        self.editor, self.viewport = Editor(self.live, look, devices), Viewport()
        self.params = hello_imgui.RunnerParams()
        self.params.app_window_params.window_title = "clrt"
        self.params.app_window_params.window_geometry.size = SIZE
        self.params.renderer_backend_options.open_gl_options.anti_aliasing_samples = 0
        self.params.fps_idling.fps_max, self.params.fps_idling.fps_idle = FASTEST, IDLE
        self.params.ini_folder_type = hello_imgui.IniFolderType.app_user_config_folder
        self.params.ini_filename = "clrt/window.ini"
        window = self.params.imgui_window_params
        window.default_imgui_window_type = hello_imgui.DefaultImGuiWindowType.provide_full_screen_dock_space
        window.show_status_bar, window.show_status_fps = True, False
        window.show_menu_bar, window.show_menu_app = False, False
        self.params.callbacks.show_gui = self.editor.frame
        self.params.callbacks.show_status = self._status
        self.params.callbacks.before_exit = self.viewport.release
        self.params.callbacks.before_swap = self.editor.take_screenshot
        self.params.docking_params.docking_splits = _splits()
        self.params.docking_params.dockable_windows = self._panels()

    def run(self, runner: Callable[..., None] = immapp.run) -> None:
        """Show the window until it is closed. runner: the function that runs the main loop, called like immapp.run.

        Raises OutputError if no window can be opened.
        """
        try:
            runner(runner_params=self.params, add_ons_params=ADD_ONS)
        except RuntimeError as fault:  # from the library that opens the window
            if not self.editor.frames:
                raise no_display(str(fault)) from fault
            raise
        finally:
            self.editor.close()
            self.live.close()

    def close(self) -> None:
        """End `run`, as closing the window does."""
        self.params.app_shall_exit = True

    def _panels(self) -> list[hello_imgui.DockableWindow]:
        places: dict[str, dict[str, Callable[[Editor], None]]] = {
            "MainDockSpace": {"Picture": self.viewport.show},
            "Panels": {
                SPHERES: spheres.show,
                MATERIALS: materials.show,
                "Lights": Lights().show,
                "Camera": CameraPanel().show,
                "Render": render.show,
                "File": Files().show,
            },
            "Figures": {"Statistics": statistics.show},
        }
        return [self._panel(place, name, show) for place, panels in places.items() for name, show in panels.items()]

    def _panel(self, place: str, name: str, show: Callable[[Editor], None]) -> hello_imgui.DockableWindow:
        panel = hello_imgui.DockableWindow(name, place, lambda: show(self.editor))
        panel.can_be_closed = False
        return panel

    def _status(self) -> None:
        snapshot = self.editor.snapshot
        shown = self.viewport.shown
        trouble = self.editor.message or snapshot.error or (shown and shown.error)
        progress = f"{snapshot.spp} samples per pixel, {snapshot.phase}, {snapshot.device}"
        imgui.text(trouble or f"{snapshot.scene.name}: {progress}")


def _splits() -> list[hello_imgui.DockingSplit]:
    """Return the layout: the viewport on the left; panels on the right, and statistics below them."""
    return [
        hello_imgui.DockingSplit("MainDockSpace", "Panels", imgui.Dir.right, 0.34),
        hello_imgui.DockingSplit("Panels", "Figures", imgui.Dir.down, 0.45),
    ]
