"""`clrt bench poses`: poses of animated glTF files against other programs."""

from __future__ import annotations

from pathlib import Path

import click

from .bench_files import figures_options, write_figures


@click.command("poses")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@click.option("--poses", type=click.IntRange(min=2), default=8, show_default=True, help="Poses of each animation.")
@figures_options
def poses_command(files: tuple[Path, ...], poses: int, json_file: Path | None) -> None:
    """Compare the poses of animated glTF files with Blender's and VTK's (pip install scipy bpy vtk).

    Values are in units of the diagonal of the pose's bounding box: the greatest distance from a vertex of either pose
    to the nearest one of the other, and the greatest difference of their bounding boxes. Blender is compared at
    keyframes, VTK also between them.
    """
    from ..bench.renderers.pose_agreement import judge
    from ..bench.renderers.pose_peers import peers

    found, rows = peers(), []
    click.echo(f"{'file':28}{'animation':24}{'':9}{'poses':>6}{'vertices':>10}{'points':>10}{'box':>10}{'at':>9}")
    for file in files:
        for judged in judge(file, poses, found):
            start = f"{judged.file:28}{judged.animation:24}{judged.peer:9}"
            values = f"{judged.poses:6}{judged.vertices:10}{judged.points:10.1e}{judged.box:10.1e}{judged.worst:8.3f}s"
            click.echo(start + (judged.problem or values))
            rows.append(judged._asdict())
    write_figures(json_file, {"rows": rows})
