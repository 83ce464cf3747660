"""Statistics panel: performance, memory, and estimated error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from imgui_bundle import hello_imgui, imgui, implot

from ...live.snapshot import Snapshot
from ..editor import Editor

#: The plot's height in lines of text.
LINES = 9
#: Tick marks of both axes.
TICKS = [step * 10.0**power for power in range(-5, 5) for step in (1, 2, 5)]


def show(editor: Editor) -> None:
    """Draw the panel."""
    snapshot = editor.snapshot
    _table("progress", _progress(snapshot))
    _noise(snapshot)
    _table("means", _means(snapshot))


def _table(name: str, rows: Iterable[tuple[str, str]]) -> None:
    if imgui.begin_table(name, 2):
        imgui.table_setup_column("", imgui.TableColumnFlags_.width_fixed.value)
        for row in rows:
            imgui.table_next_column()
            imgui.text_disabled(row[0])
            imgui.table_next_column()
            imgui.text_wrapped(row[1])
        imgui.end_table()


def _progress(snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    """Yield rows about speed and progress."""
    yield "window", f"{hello_imgui.frame_rate():.0f} frames/s"
    yield "pictures", f"{snapshot.frames_per_second:.1f} /s"
    yield "rays", f"{snapshot.rays_per_second / 1e6:.2f} million/s"
    height, width = snapshot.pixels.shape[:2]
    yield "resolution", f"{width} x {height}" + ("" if (width, height) == snapshot.size else " for now")
    yield "samples", f"{snapshot.spp} of {snapshot.scene.render.spp} per pixel in {snapshot.seconds:.2f} s"
    yield "noise", "-" if snapshot.noise is None else f"{100 * snapshot.noise:.2f} %"
    yield "state", snapshot.phase


def _means(snapshot: Snapshot) -> Iterator[tuple[str, str]]:
    """Yield rows about device, memory, BVH and programs."""
    yield "device", snapshot.device
    yield "device memory", f"{snapshot.device_bytes / 2**20:.1f} MiB"
    tree = snapshot.tree
    if tree:
        yield "BVH", f"{tree['layout']} by {tree['builder'] or 'none'}, {tree['nodes']} nodes, {tree['bytes']} bytes"
        yield "", f"{tree['triangles']} triangles, {tree['spheres']} spheres, {tree['instances']} instances"
        yield "built in", f"{1000 * tree['build_seconds']:.1f} ms"
    yield "programs built", str(snapshot.programs)
    yield "features", " ".join(snapshot.features)


def _noise(snapshot: Snapshot) -> None:
    """Plot the estimated error over time, both axes logarithmic."""
    points = np.array(
        [(entry["seconds"], entry["noise"]) for entry in snapshot.history if entry["noise"] and entry["seconds"] > 0],
        np.float64,
    ).reshape(-1, 2)
    spans = len(points) > 1  # a single point leaves the axes without extent
    if implot.begin_plot(
        "##noise",
        (-1, LINES * imgui.get_text_line_height_with_spacing()),
        implot.Flags_.no_legend.value | implot.Flags_.no_mouse_text.value,
    ):
        fit = implot.AxisFlags_.auto_fit.value
        implot.setup_axes("seconds", "noise", fit, fit)
        for axis in (implot.ImAxis_.x1.value, implot.ImAxis_.y1.value) if spans else ():
            implot.setup_axis_scale(axis, implot.Scale_.log10.value)
            implot.setup_axis_ticks(axis, TICKS, [f"{tick:g}" for tick in TICKS])
        if spans:
            implot.plot_line("noise", np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1]))
        implot.end_plot()
