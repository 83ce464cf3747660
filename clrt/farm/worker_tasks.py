"""Functions that run on workers. Schedulers import this module, too, so heavy imports are local to functions.

A worker caches the scenes that it was prepared for, compiled, with their BVHs, on its devices. The devices do one thing
at a time, regardless of how many tasks Dask starts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec

from .. import errors
from ..errors import DeviceError
from .serialization import unpack
from .worker_devices import about, opened

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .orders import Order
    from .share_renderer import ShareRenderer
    from .simulated_workers import Simulation

P = ParamSpec("P")
#: Scenes that a worker caches; the least recently used is evicted.
MOST_KEPT = 2
_renderers: dict[str, ShareRenderer | Simulation] = {}
_starting, _table = Lock(), Lock()


def identity() -> dict[str, str]:
    """Return what must be equal on the client and all workers: the version, and digests of kernels and code."""
    from importlib.metadata import version

    from ..device.programs.kernel_files import kernel_digest
    from ..rendering.checkpoint.identity import code_digest

    return {"version": version("clrt"), "kernels": kernel_digest()[:16], "code": code_digest()[:16]}


class Answer(NamedTuple):
    """A function's result or error, as the class (of clrt.errors or builtins) and its text.

    Errors are sent as text, since not everything in them can be serialised.
    """

    value: Any
    error: str = ""
    text: str = ""

    def result(self) -> Any:
        """Return the value, or raise the error."""
        if not self.error:
            return self.value
        kind = getattr(errors, self.error, None)
        if kind is None:
            raise LookupError(self.text) if self.error == "LookupError" else RuntimeError(f"{self.error}: {self.text}")
        raise kind(self.text)


def answering(function: Callable[P, Any]) -> Callable[P, Answer]:
    """Wrap a function to return an Answer."""

    @wraps(function)
    def answer(*arguments: P.args, **named: P.kwargs) -> Answer:
        try:
            return Answer(function(*arguments, **named))
        except Exception as error:  # every error is reported to the client
            return Answer(None, type(error).__name__, str(error))

    return answer


def as_it_is(value: Any) -> Any:
    """Return the value: a task that holds an array."""
    return value


@answering
def introduce(client: dict[str, str], devices: tuple[str | int, ...]) -> dict[str, Any]:
    """Return the worker's device names, platforms and drivers. Raises DeviceError if it cannot render."""
    _check_identity(client)
    with _starting:
        return about(opened(devices))


@answering
def prepare(client: dict[str, str], key: str, text: bytes, digests: list[str], *arrays: NDArray[Any]) -> dict[str, Any]:
    """Compile an order (see `ShareRenderer`) and cache it under `key`.

    Returns data on the worker, its part of the report, and its proof (`ShareRenderer.proof`). Raises DeviceError,
    KernelError and SceneError.
    """
    _check_identity(client)
    with _starting:
        if (renderer := _found(key)) is None:
            with _table:
                for old in list(_renderers)[: len(_renderers) + 1 - MOST_KEPT]:
                    del _renderers[old]
            renderer = _renderers[key] = _made(unpack(text, dict(zip(digests, arrays))))
        return {**renderer.introduction(), "report": renderer.report(), "proof": renderer.proof()}


@answering
def render_share(
    key: str, tiles: NDArray[Any], first: int, more: int, pixels: NDArray[Any] | None
) -> tuple[NDArray[Any], float]:
    """Return the pixels (tiles, TILE_PIXELS) with samples first … first + more − 1 added, and the seconds taken.

    pixels: their values before, None without samples. Raises DeviceError if no device can go on.
    """
    start = time.perf_counter()
    return _renderer(key).share(tiles, first, more, pixels), time.perf_counter() - start


@answering
def draw(key: str, names: tuple[str, ...] | None) -> dict[str, NDArray[Any]]:
    """Return AOVs of the first hits by name, or the denoiser's guides if `names` is None."""
    return _renderer(key).drawn(names)


@answering
def render_whole(
    client: dict[str, str], key: str, text: bytes, part: bytes, digests: list[str], *arrays: NDArray[Any]
) -> tuple[dict[str, Any], float]:
    """Return a whole image, or a band of one, with its AOVs, and the seconds taken (see `band_renderer.render`).

    text: the order, identified by its key; part: its camera and band.
    """
    _check_identity(client)
    from .band_renderer import render

    with _starting:
        start = time.perf_counter()
        camera, band = unpack(part, {})
        order = replace(unpack(text, dict(zip(digests, arrays))), camera=camera, band=band)
        return render(key, order), time.perf_counter() - start


def _made(order: Order) -> ShareRenderer | Simulation:
    if order.simulated is not None:
        from .simulated_workers import Simulation

        return Simulation(order)
    from .share_renderer import ShareRenderer

    return ShareRenderer(order)


def _check_identity(client: dict[str, str]) -> None:
    """Raise DeviceError if clrt differs from the client's: images could differ, or records be incompatible."""
    own = identity()
    if own != client:
        told = [
            f"clrt {each['version']} with the kernels {each['kernels']} and the code {each.get('code')}"
            for each in (own, client)
        ]
        raise DeviceError(f"it runs {told[0]}, this client {told[1]}; install the same version on both")


def _found(key: str) -> ShareRenderer | Simulation | None:
    """Return the cached renderer, now the last to be evicted, or None. Thread-safe."""
    with _table:
        if key in _renderers:
            _renderers[key] = _renderers.pop(key)
        return _renderers.get(key)


def _renderer(key: str) -> ShareRenderer | Simulation:
    renderer = _found(key)
    if renderer is None:
        raise LookupError(f"this worker was not prepared for {key}")
    return renderer
