"""`clrt bench build`: BVH builds by number of triangles."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures
from .tables import race_legend, race_table


@click.command("build")
@click.option("--mesh", type=click.Path(path_type=Path), metavar="FILE", help="Model file; default: a bumpy sphere.")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@click.option("--quick", is_flag=True, help="Use up to 16 thousand triangles instead of 10 million.")
@figures_options
def build_command(mesh: Path | None, device: str | None, quick: bool, json_file: Path | None) -> None:
    """Measure BVH builds over 10 thousand to 10 million triangles: the mesh in a closed room, simplified or subdivided.

    Prints time and memory of each builder (and of Embree, if pip's embreex is installed) and the SAH cost of its BVH;
    then rays per second by size, with the time per ray fitted by a + b·log2(triangles); then how long a new process
    takes from the arrays to its first hits.
    """
    from ..bench.rays.build_speed import measure_build
    from ..bench.rays.ray_speed import load_triangles
    from ..bench.rays.workloads import bumpy_ball

    figures: dict[str, Any] = {"mesh": mesh, "sizes": []}
    lines = {"size": _builder_lines, "rays": _ray_lines, "fresh": _fresh_lines}
    for part, result in measure_build(*(load_triangles(mesh) if mesh else bumpy_ball()), quick=quick, device=device):
        click.echo("\n".join(lines[part](result)) + "\n")
        figures |= {"sizes": figures["sizes"] + [result]} if part == "size" else {part: result}
    write_figures(json_file, figures)


def _builder_lines(result: Mapping[str, Any]) -> list[str]:
    lines = [
        f"{result['triangles']} triangles; {result['device']}, {result['platform']}",
        f"  {result['layout'] + ' of':12}" + "".join(f"{title:>12}" for title, _, _ in BUILDER_COLUMNS),
    ]
    for name, row in result["builders"].items():
        lines.append(
            f"  {name:12}"
            + "".join(
                f"{row[key]:{form}}" if row.get(key) is not None else " " * 12 for _, key, form in BUILDER_COLUMNS
            )
        )
    return lines + [
        "  first call: seconds including setup; peak: bytes in use while the device builds",
        "  ratio: SAH cost relative to the builder sah",
    ]


BUILDER_COLUMNS = [
    ("seconds", "seconds", "12.4f"),
    ("first call", "first_seconds", "12.4f"),
    ("Mtri/s", "mtriangles", "12.3f"),
    ("B/triangle", "bytes_per_triangle", "12.1f"),
    ("peak B/tri", "peak_bytes_per_triangle", "12.1f"),
    ("SAH cost", "sah_cost", "12.2f"),
    ("ratio", "cost_ratio", "12.3f"),
    ("depth", "depth", "12"),
    ("stack", "stack", "12"),
]


def _ray_lines(result: Mapping[str, Any]) -> list[str]:
    on_cpu = result["device_type"] == "cpu"
    lines = race_table("triangles", result["kinds"], on_cpu, agrees=False)
    lines += [race_legend(on_cpu), "  seconds per ray = a + b·log2(triangles)"]
    return lines + [
        f"  {kind:12} a = {1e9 * fit['a']:8.1f} ns, b = {1e9 * fit['b']:6.2f} ns, R² = {fit['r2']:.3f}"
        for kind, fit in result["fits"].items()
    ]


def _fresh_lines(result: Mapping[str, Any]) -> list[str]:
    lines = [f"  {'a new process, seconds':24}{'BVH':>10}{'query':>10}{'first call':>12}{'peak, MB':>10}"]
    names = {"compiled": "kernels compiled", "cached": "kernels cached", "largest": "the largest mesh"}
    for name, row in result.items():
        peak = f"{row['peak_bytes'] / 1e6:10.0f}" if row["peak_bytes"] else f"{'?':>10}"
        lines.append(
            f"  {names[name]:24}{row['tree_seconds']:10.3f}{row['build_seconds']:10.3f}"
            f"{row['answer_seconds']:12.3f}{peak}"
        )
    return lines + ["  query: from the arrays to the BVH on the device; first call: from there to the first hits"]
