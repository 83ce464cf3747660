"""Interactive rendering of a scene that is edited: a thread renders the newest scene and publishes snapshots."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from threading import RLock
from types import TracebackType
from typing import Any

import numpy as np

from ..device.open import name_of
from ..errors import ClrtError
from ..output.image import Image
from ..rendering.accumulation.device_report import tree_report
from ..rendering.compile.features import INTEGRATORS
from ..rendering.render_report import render_report
from ..rendering.renderer import Renderer, State
from ..scene.model import Scene
from ..threads import Condition, beside
from .history import History
from .live_renderer import ImageRequest, LiveRenderer, Superseded
from .picks import PickRequests, Thing
from .settings import Selector, Settings
from .snapshot import Snapshot

#: Seconds without an edit after which a movement has ended.
SETTLED = 0.2
_log = logging.getLogger(__name__)


class Live:
    """Interactive renderer. All methods are thread-safe and return at once, except for `wait`, `image` and `close`.

    Scenes are never modified in place: `edit` takes a new one that shares what is unchanged (dataclasses.replace),
    which is then not uploaded, built or compiled again. device: overrides that of `settings`.
    """

    def __init__(self, scene: Scene, *, device: Selector = None, settings: Settings = Settings()) -> None:
        if device is not None:
            settings = replace(settings, device=device)
        self._asked = self._current = ImageRequest(1, scene, settings, False)
        size = self._asked.size
        black = np.zeros((size[1], size[0], 3), np.float32)
        self._snapshot = Snapshot(scene=scene, settings=settings, pixels=black, size=size)
        self._still: tuple[Renderer, State] | None = None
        self._times: deque[float] = deque(maxlen=64)
        self._history, self._picks = History(), PickRequests()
        self._lock, self._changed = RLock(), Condition()
        self._closed = False
        self._unseen = True  # no image of the current request has been published
        self._renderer = LiveRenderer(self._begin)
        self._wait_for_end = beside(self._work, daemon=True)

    @property
    def scene(self) -> Scene:
        """The newest scene requested."""
        return self._asked.scene

    @property
    def settings(self) -> Settings:
        """The newest settings requested."""
        return self._asked.settings

    @property
    def asked(self) -> int:
        """Number of the newest edit or choice; a snapshot contains the number that it shows."""
        return self._asked.number

    def edit(self, scene: Scene, *, moving: bool = False, step: bool = True) -> None:
        """Show this scene from now on; accumulation starts afresh.

        moving: more edits follow immediately, as while dragging or walking: the resolution is reduced as far as the
        target frame rate requires, until there was none for SETTLED seconds. They form one step of the history. step:
        whether it can be undone; walks should not be.
        """
        with self._lock:
            if step:
                self._history.record(self.scene, scene, moving)
            self._ask(scene=scene, moving=moving)

    def choose(self, settings: Settings) -> None:
        """Use these settings from now on."""
        self._ask(settings=settings, moving=False)

    def undo(self) -> None:
        """Undo the last step, if there is one."""
        with self._lock:
            if self._history.can_undo:
                self._ask(scene=self._history.undo(self.scene), moving=False)

    def redo(self) -> None:
        """Redo the step that was undone last, if there is one."""
        with self._lock:
            if self._history.can_redo:
                self._ask(scene=self._history.redo(self.scene), moving=False)

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return self._history.can_undo

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to redo."""
        return self._history.can_redo

    def snapshot(self) -> Snapshot:
        """Return the newest image and its progress."""
        return self._snapshot

    def wait(self, until: Callable[[Snapshot], bool], seconds: float | None = None) -> Snapshot:
        """Return the first snapshot for which `until` holds, or the current one after `seconds` or when closed."""
        snapshot = self._snapshot

        def holds() -> bool:
            nonlocal snapshot
            snapshot = self._snapshot
            return self._closed or until(snapshot)

        self._changed.wait_for(holds, seconds)
        return snapshot

    def pick(self, x: float, y: float) -> Future[Thing | None]:
        """Return a future of the first hit at a position of the image, or None for the sky; (0, 0) is the upper left
        corner, (1, 1) the lower right. It is an object of the scene shown when answered. Raises the errors of renders.
        """
        with self._lock:
            found = self._picks.ask(x, y)
            if self._closed:
                self._picks.cancel()
            self._changed.notify()
        return found

    def image(self) -> Image:
        """Return the newest image for saving; with its full report if it has the full size."""
        with self._lock:
            still, snapshot = self._still, self._snapshot
        report = render_report(*still) if still else {"integrator": snapshot.scene.render.integrator}
        raw = None if snapshot.denoised is None else snapshot.pixels
        return Image(snapshot.shown, report, raw, alpha=snapshot.alpha)

    def close(self) -> None:
        """Stop the thread and wait for its end."""
        with self._lock:
            self._closed = True
            self._renderer.abandon()
            self._changed.notify()
        self._wait_for_end()
        self._picks.cancel()

    def __enter__(self) -> Live:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, **changes: Any) -> None:
        with self._lock:
            self._asked = self._asked._replace(number=self._asked.number + 1, **changes)
            if not (self._unseen and self._asked.moving):
                self._renderer.abandon()
            self._changed.notify()

    def _work(self) -> None:
        """Render the newest request, until closed. Runs in the thread."""
        last: ImageRequest | None = None
        while (asked := self._next(last)) is not None:
            try:
                if asked is last:
                    self._picks.answer(self._renderer.seen_at)
                else:
                    last = asked
                    self._show(asked)
            except Superseded:
                pass
            except ClrtError as error:
                self._publish(asked=asked.number, error=str(error), phase="rest")
            except Exception as error:  # a bug must not freeze the image forever
                _log.exception("rendering an image failed")
                self._publish(asked=asked.number, error=f"{type(error).__name__}: {error}", phase="rest")

    def _next(self, last: ImageRequest | None) -> ImageRequest | None:
        """Wait for a request other than the last, or for picks in the last, and return it; None when closed."""
        self._changed.wait_for(lambda: self._closed or bool(self._picks) or self._asked is not last)
        with self._lock:  # else the newest request could be abandoned along with the last
            return None if self._closed else self._asked

    def _show(self, asked: ImageRequest) -> None:
        """Render a request to its end, first at reduced size if the full size would take too long."""
        self._unseen = True
        quick = self._renderer.quick_size(asked)
        if quick != asked.size:
            self._render(asked, quick, asked.settings.samples)
            if asked.moving:
                self._publish(phase="rest")
                self._changed.wait_for(lambda: self._is_superseded(asked), SETTLED)
        self._render(asked, asked.size, asked.scene.render.spp)
        self._publish(phase="rest")

    def _render(self, asked: ImageRequest, size: tuple[int, int], spp: int) -> None:
        if self._is_superseded(asked):
            raise Superseded
        self._current, self._still = asked, None
        for state in self._renderer.states(asked, size, spp):
            if state.spp >= min(asked.settings.samples, spp):
                self._publish_picture(asked, state)
                if self._is_superseded(asked):
                    raise Superseded
                self._picks.answer(self._renderer.seen_at)
                if self._is_denoised(asked, size) and (pixels := self._renderer.denoised(state)) is not None:
                    self._publish(denoised=pixels)
        if self._is_superseded(asked):
            raise Superseded

    def _is_denoised(self, asked: ImageRequest, size: tuple[int, int]) -> bool:
        """Return whether the image is denoised: it must show light and have the full size."""
        light = asked.scene.render.integrator in INTEGRATORS
        return asked.settings.denoise and light and size == asked.size and not self._is_superseded(asked)

    def _is_superseded(self, asked: ImageRequest) -> bool:
        """Return whether something newer is to be shown instead; during a movement the current image is shown first, as
        otherwise nothing would be shown until it ends."""
        newest = self._asked
        return self._closed or newest is not asked and not (self._unseen and newest.moving)

    def _begin(self, phase: str) -> None:
        if self._is_superseded(self._current):
            raise Superseded
        self._publish(phase=phase)

    def _publish_picture(self, asked: ImageRequest, state: State) -> None:
        renderer = self._renderer.renderer
        assert renderer is not None
        now = time.perf_counter()
        self._times.append(now)
        whole, last = renderer.settings.size == asked.size, self._snapshot
        kept = last.denoised if asked.settings.denoise and whole and last.asked == asked.number else None
        picture = {
            "scene": asked.scene,
            "settings": asked.settings,
            "asked": asked.number,
            "number": last.number + 1,
            "size": asked.size,
            "pixels": state.pixels,
            "alpha": state.alpha if state.film.backdrop is None else None,
            "denoised": kept,
            "spp": state.spp,
            "seconds": state.seconds,
            "noise": state.noise,
            "history": list(renderer.history),
            "error": None,
            "frames_per_second": float(sum(now - each < 1 for each in self._times)),
            "rays_per_second": state.film.rays / max(state.seconds, 1e-9),
            "device": name_of(renderer.devices),
            "device_bytes": renderer.session.device_bytes,
            "tree": tree_report(renderer.compiled),
            "features": renderer.compiled.features,
            "programs": self._renderer.programs,
        }
        with self._lock:
            self._still = (renderer, state) if whole else None
            self._unseen = False
            self._publish(**picture)

    def _publish(self, **changes: Any) -> None:
        with self._lock:
            self._snapshot = replace(self._snapshot, **changes)
            self._changed.notify()
