"""`clrt bench rays`: rays per second through one mesh."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import click

from ..accel.methods import BuilderName, LayoutName
from .bench_files import figures_options, write_figures
from .option_types import OneOf
from .options import hit_options


@click.command("rays")
@click.option("--mesh", type=click.Path(path_type=Path), metavar="FILE", help="Model file; default: a bumpy sphere.")
@click.option(
    "--rays",
    type=click.Path(path_type=Path),
    metavar="FILE.npz",
    help="Arrays origins (n, 3), directions (n, 3), t_max (n,); default: four kinds, in a closed room.",
)
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@click.option(
    "--layout",
    type=OneOf(get_args(LayoutName)),
    help="BVH layout; default: all of them or, with --rays, the device's default.",
)
@hit_options
@click.option("--builder", type=OneOf(get_args(BuilderName)), help="BVH builder.")
@click.option("--quick", is_flag=True, help="Use fewer rays and a smaller sphere.")
@figures_options
def rays_command(mesh: Path | None, rays: Path | None, quick: bool, json_file: Path | None, **options: Any) -> None:
    """Measure rays per second through a mesh, for kernels alone and for whole calls from Python.

    With --rays: the closest hit and any hit of the file's rays. Without: camera rays, bounce rays and shadow rays to
    two lights, with every BVH layout in interleaved runs.
    """
    from ..bench.rays.layout_speed import measure_layouts
    from ..bench.rays.ray_speed import load_rays, load_triangles, measure_rays
    from ..bench.rays.workloads import bumpy_ball

    if rays is not None and mesh is None:
        raise click.UsageError("--rays needs the mesh to intersect: add --mesh FILE")
    triangles = load_triangles(mesh) if mesh else bumpy_ball(5 if quick else 7)
    if rays is not None:
        result = measure_rays(*triangles, load_rays(rays), repeats=3 if quick else 7, **options)
        lines = [
            f"{name:20} {value:.6g}" if isinstance(value, float) else f"{name:20} {value}"
            for name, value in result.items()
        ]
    else:
        result = measure_layouts(*triangles, quick=quick, **options)
        lines = _lines(result)
    click.echo("\n".join(lines))
    write_figures(json_file, result)


def _lines(result: Mapping[str, Any]) -> list[str]:
    trees, kinds = result["trees"], result["kinds"]
    lines = [
        f"{result['triangles']} triangles in a closed room; {result['device']}, {result['platform']}",
        f"  {'BVH':24}{'builder':>12}{'seconds':>10}{'B/triangle':>12}{'SAH cost':>10}{'depth':>7}{'stack':>7}",
    ]
    lines += [
        f"  {name:24}{tree['builder']:>12}{tree['tree_seconds']:10.3f}{tree['bytes_per_triangle']:12.1f}"
        f"{tree['sah_cost']:10.2f}{tree['depth']:7}{tree['stack']:7}"
        for name, tree in trees.items()
    ]
    for kind, rows in kinds.items():
        hits = next(iter(rows.values()))["hits"]
        lines.append(f"  {f'{kind}: {hits:.0%} hit':24}" + "".join(f"{title:>12}" for title, _, _ in COLUMNS))
        lines += [
            f"  {name:24}" + "".join(f"{row[key]:{form}}" for _, key, form in COLUMNS) for name, row in rows.items()
        ]
    return lines + LEGEND


COLUMNS = [
    ("rays", "rays", "12"),
    ("Mrays/s", "mrays", "12.3g"),
    ("in calls", "mrays_call", "12.3g"),
    ("time", "ratio", "12.2f"),
    ("CPU time", "cpu_ratio", "12.2f"),
    ("nodes", "nodes", "12.2f"),
    ("leaf tests", "tests", "12.2f"),
    ("differ", "differ", "12"),
]
LEGEND = [
    "  Mrays/s: kernels alone, and in whole calls from Python",
    "  time, CPU time (processor time): per ray, over the first line's; above 1 is slower",
    "  nodes, leaf tests: visited per ray; a leaf test intersects one triangle, in bvh8 eight",
    "  differ: number of hits that differ from the first line's in any bit",
]
