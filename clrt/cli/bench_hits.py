"""`clrt bench hits`: how many hits differ between BVHs, builders and devices, and from float64."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("hits")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`. Default: all of them.")
@click.option("--quick", is_flag=True, help="Use smaller meshes and fewer rays.")
@figures_options
def hits_command(device: str | None, quick: bool, json_file: Path | None) -> None:
    """Trace the same rays with every BVH layout, builder and device, and count the hits that are not bitwise equal.

    A million rays per mesh: random ones, and rays aimed at vertices, at edges and along the axes. Then counts the hits
    that are wrong according to float64.
    """
    from ..bench.numerics.hit_agreement import measure_hits
    from ..device.discovery.discover import choose, devices

    only = None if device is None else choose(device)[0].index
    found, results = [each for each in devices() if each["usable"] and only in (None, each["index"])], []
    for each in found:
        click.echo(f"device {each['index']}: {each['name']} ({each['platform']}, {each['driver']})")
    click.echo("Below each kind of rays: number of hits that differ from the first line's in any bit")
    for result in measure_hits(quick=quick, device=device):
        click.echo("\n" + "\n".join(_lines(result)))
        results.append(result)
    write_figures(json_file, {"devices": found, "meshes": results})


def _lines(result: Mapping[str, Any]) -> list[str]:
    """Return a line per configuration: for how many rays of each kind the result differs from the first line's."""
    title = f"  {'device layout builder      traversal':40}{'rays':>9}"
    lines = [
        f"{result['mesh']}: {result['triangles']} triangles, {result['rays']} rays",
        title + "".join(f"{kind:>10}" for kind in result["kinds"]),
    ]
    for way in result["ways"]:
        line = f"  {way['device']:<6} {way['layout']:6} {way['builder']:12} {way['traversal']:9}    "
        lines.append(
            line
            + (
                way["error"]
                if "error" in way
                else f"{way['rays']:9}" + "".join(f"{count:10}" for count in way["differ"].values())
            )
        )
    if "exact" in result:
        exact = result["exact"]
        lines.append(
            f"  checked in float64: {exact['wrong']} of {exact['rays']} hits impossible (only one triangle "
            f"was possible for {exact['decided']})"
        )
        if result["escaped"] is not None:
            lines.append(f"  rays from the inside that hit nothing: {result['escaped']}")
        lines.append(f"  hits on degenerate triangles (collinear corners, seams between others): {result['flat']}")
    return lines
