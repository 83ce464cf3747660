"""`clrt bench peers`: clrt compared with other ray casting libraries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures
from .tables import race_legend, race_table


@click.command("peers")
@click.option("--mesh", type=click.Path(path_type=Path), metavar="FILE", help="Model file; default: a bumpy sphere.")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@click.option("--quick", is_flag=True, help="Use one scene and fewer rays.")
@figures_options
def peers_command(mesh: Path | None, device: str | None, quick: bool, json_file: Path | None) -> None:
    """Trace the same rays with clrt and other libraries, in interleaved runs.

    Embree, from pip's embreex, is called from C on all processors: with single rays or packets of 8, in fast and in
    robust mode, without and with its flag for coherent rays. Python libraries are measured by whole calls.
    """
    from ..bench.rays.library_speed import measure_peers, versions
    from ..bench.rays.ray_speed import load_triangles
    from ..bench.rays.workloads import bumpy_ball

    results = []
    for result in measure_peers(*(load_triangles(mesh) if mesh else bumpy_ball()), quick=quick, device=device):
        click.echo("\n".join(_lines(result)) + "\n")
        results.append(result)
    write_figures(json_file, {"mesh": mesh, "versions": versions(), "scenes": results})


def _lines(result: Mapping[str, Any]) -> list[str]:
    on_cpu = result["device_type"] == "cpu"
    lines = [f"{result['scene']}: {result['triangles']} triangles; {result['device']}, {result['platform']}"]
    lines += [
        f"  BVH of {name:23}{tree['seconds']:8.2f} s {tree['bytes'] / 1e6:8.1f} MB"
        for name, tree in result["trees"].items()
    ]
    hits = (f"{result['hits'][name]:9.2f} of{kind['clrt']['rays']:9}" for name, kind in result["kernels"].items())
    lines.append(f"  {'fraction of hits':24}{'  '.join(hits)}")
    lines += race_table("kernels alone", result["kernels"], on_cpu)
    if "calls" in result:
        lines += race_table("whole calls from Python", result["calls"], on_cpu)
    lines += [race_legend(on_cpu), "  agrees: fraction of the results that equal the first line's"]
    return lines + [f"  {name:24}{why}" for name, why in result["missing"].items()]
