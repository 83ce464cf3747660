"""`clrt bench`: experiments, each with its figures as a table and as JSON."""

from __future__ import annotations

from pathlib import Path

import click

from .bench_peers import peers_command


@click.group()
def command() -> None:
    """Measure this machine: rays, peers."""


command.add_command(peers_command)


@command.command("rays")
@click.option("--mesh", type=click.Path(path_type=Path), required=True, metavar="FILE", help="A model file.")
@click.option("--rays", type=click.Path(path_type=Path), metavar="FILE.npz",
              help="origins (n, 3), directions (n, 3), t_max (n,); default: a million rays all around.")
@click.option("--device", metavar="SEL", help="See `clrt devices`.")
@click.option("--layout", type=click.Choice(["bvh8", "bvh2", "cwbvh", "list"]), help="Tree layout.")
@click.option("--triangle", type=click.Choice(["watertight", "moller_trumbore"]), default="watertight",
              show_default=True, help="Triangle test.")
@click.option("--builder", type=click.Choice(["ploc", "sah", "midpoint"]), help="Tree builder.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), metavar="FILE", help="Write the figures there.")
def rays_command(mesh: Path, rays: Path | None, device: str | None, layout: str | None, triangle: str,
                 builder: str | None, json_file: Path | None) -> None:
    """Rays a second through a mesh: kernels alone (mrays_…) and whole calls from Python (mrays_…_call)."""
    from ..output.files import check_target
    from ..output.report import write_report
    from ..study.rays import load_rays, load_triangles, measure_rays, scattered_rays

    if json_file is not None:
        check_target(json_file)
    vertices, faces = load_triangles(mesh)
    result = measure_rays(vertices, faces, load_rays(rays) if rays else scattered_rays(vertices), device=device,
                          layout=layout, triangle=triangle, builder=builder)
    for name, value in result.items():
        click.echo(f"{name:20} {value:.6g}" if isinstance(value, float) else f"{name:20} {value}")
    if json_file is not None:
        write_report(json_file, result)
        click.echo(str(json_file))
