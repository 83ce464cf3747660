"""`clrt render --scheduler` and `--local-cluster`: the same command on the workers of a cluster (docs/farm.md)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from ..errors import UsageError
from ..rendering.checkpoint.policy import CheckpointPolicy
from .frames import FrameSequence
from .goal import Goal
from .interrupt import Interruptible
from .option_groups import flag
from .outputs import Outputs
from .progress_reporter import Progress

if TYPE_CHECKING:
    from ..farm.cluster import Cluster
    from ..rendering.renderer import Renderer
    from ..rendering.renderer_options import RendererOptions
    from ..scene.model import Scene


@dataclass(frozen=True)
class ClusterOptions:
    """A cluster that renders instead of this machine's devices."""

    scheduler: str | None = flag(
        "--scheduler",
        metavar="ADDRESS",
        help="Render on the workers of a Dask scheduler, tcp://… or tls://…; --device is one of theirs.",
    )
    local_cluster: int | None = flag(
        "--local-cluster",
        type=click.IntRange(min=1),
        metavar="N",
        help="Render with N worker processes on this machine; needs Dask.",
    )


@contextmanager
def cluster_for(asked: ClusterOptions, progress: Progress) -> Iterator[Cluster | None]:
    """Provide the requested cluster; None if this machine's devices render."""
    scheduler, local = asked.scheduler, asked.local_cluster
    if scheduler is None and local is None:
        yield None
        return
    if scheduler is not None and local is not None:
        raise UsageError("--scheduler and --local-cluster select two clusters; keep one of them")
    from ..farm.cluster import connect, local_cluster

    progress.phase("connect")
    with connect(scheduler) if scheduler is not None else local_cluster(local or 1) as cluster:
        yield cluster


def make_renderer(cluster: Cluster | None, scene: Scene, options: RendererOptions) -> Renderer:
    """Return a renderer on the cluster, or on this machine's devices."""
    if cluster is None:
        from ..rendering.renderer import Renderer

        return Renderer(scene, **options)
    from ..farm.farm_renderer import FarmRenderer

    return FarmRenderer(scene, cluster, **options)


def is_huge(size: tuple[int, int]) -> bool:
    """Return whether an image is rendered in bands, as it would not fit into the client's memory."""
    from ..farm.banded_picture import HUGE

    return size[0] * size[1] > HUGE


def render_huge(
    cluster: Cluster, scene: Scene, options: RendererOptions, goal: Goal, results: Outputs, progress: Progress
) -> bool:
    """Render in bands, each to the goal, and write the results; return False if interrupted."""
    from ..farm.banded_picture import BandedPicture
    from ..farm.orders import PictureOrder

    for name, value in {
        "--time": goal.seconds,
        "--aov": options["aovs"] or None,
        "--plot": results.plot,
        "--denoise": results.denoise or None,
    }.items():
        if value is not None:
            raise UsageError(
                f"{name}: is not supported for images of more than 8 million pixels, which are rendered "
                "in bands, each by a worker; leave it out, or choose a smaller --size"
            )
    checkpoint, resume = options["checkpoint"], options["resume"]
    chosen = {name: value for name, value in _of_worker(options).items() if name != "aovs"}
    banded = BandedPicture(
        PictureOrder(scene, chosen, spp=goal.spp, error=goal.error),
        Path(checkpoint or f"{next(iter(results.pictures), 'image')}.bands"),
    )
    interrupted: list[bool] = []
    with Interruptible(lambda: interrupted.append(True)):
        for done, count in banded.render(cluster, resume):
            progress.bands(done, count)
            if interrupted:
                break
    if not interrupted:
        progress.phase("write")
        _warn(scene, banded.summary()["warnings"])
        results.save_rows(banded)
    if not interrupted or checkpoint is None:
        banded.forget()
    return not interrupted


def render_frames(
    cluster: Cluster, scene: Scene, options: RendererOptions, goal: Goal, sequence: FrameSequence, progress: Progress
) -> bool:
    """Render the remaining frames, each on a worker, and encode the videos; return False if interrupted."""
    from ..farm.orders import PictureOrder
    from ..farm.whole_pictures import WholePictures
    from ..output.image import Image
    from ..rendering.compile.visible_parts import same_world

    order = PictureOrder(scene, _of_worker(options), goal.spp, goal.seconds, goal.error, sequence.outputs.denoise)
    shots = {
        f"frame {results.header['frame']}": results for results, _ in sequence.left(order.settled, order.choices, goal)
    }

    def order_of(name: str) -> PictureOrder:
        still = sequence.still(shots[name].header["frame"])
        return replace(order, camera=still.camera) if same_world(still, scene) else replace(order, scene=still)

    pictures = WholePictures(cluster, list(shots), order_of, cast(tuple[str, ...], options["device"] or ()))
    interrupted, done, warned = list[bool](), 0, set[str]()
    progress.phase("render")
    with Interruptible(lambda: interrupted.append(True)):
        for found in pictures.results():
            if found is not None:
                results, image = shots[found[0]], Image(**found[1])
                progress.frame(results.header["frame"], done, len(shots))
                done += 1
                _warn(scene, sorted({*image.report["warnings"]} - warned))
                warned.update(image.report["warnings"])
                results.save_frame(replace(image, report=image.report | results.header))
            if interrupted:
                return False
    sequence.join()
    return True


def _of_worker(options: RendererOptions) -> dict[str, Any]:
    """Return the options of a worker's renderer: the client writes the checkpoints."""
    of_client = {field.name for field in fields(CheckpointPolicy)}
    return {name: value for name, value in options.items() if name not in of_client}


def _warn(scene: Scene, texts: Iterable[str]) -> None:
    """Log the workers' warnings, as their own logs are not transferred."""
    for text in texts:
        logging.getLogger(__name__).warning("%s: %s", scene.name, text)
