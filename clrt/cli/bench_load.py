"""`clrt bench load`: how fast model files are read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("load")
@click.option(
    "--triangles", type=click.IntRange(2), default=1_600_000, show_default=True, metavar="N", help="Triangles."
)
@click.option("--rounds", type=click.IntRange(1), default=5, show_default=True, metavar="N", help="Interleaved rounds.")
@click.option("--file", "names", multiple=True, metavar="NAME", help="Only this file, such as corners.obj; repeatable.")
@figures_options
def load_command(triangles: int, rounds: int, names: tuple[str, ...], json_file: Path | None) -> None:
    """Read a mesh from files of all formats with clrt and, if they are installed, trimesh, Open3D and Blender (bpy).

    Each file is read in a new process, in interleaved rounds. Libraries are imported before; the peak memory is what
    reading adds to that.
    """
    from ..bench.reading.model_files import FILES
    from ..bench.reading.read_speed import measure_reading

    if unknown := [name for name in names if name not in FILES]:
        raise click.BadParameter(f"{unknown[0]!r} is not one of {', '.join(FILES)}", param_hint="--file")
    results = []
    for result in measure_reading(triangles, rounds, names):
        click.echo("\n".join(_lines(result)) + "\n")
        results.append(result)
    click.echo("  time, CPU: over clrt's; above 1 is slower")
    write_figures(json_file, {"rounds": rounds, "files": results})


def _lines(result: Mapping[str, Any]) -> list[str]:
    lines = [
        f"{result['file']}: {result['triangles']} triangles, {result['bytes'] / 1e6:.1f} MB",
        f"  {'':10}{'seconds':>9}{'CPU s':>9}{'time':>7}{'CPU':>7}{'MB':>7}",
    ]
    for name, row in result["readers"].items():
        if "error" in row:
            lines.append(f"  {name:10}{row['error'][:80]}")
            continue
        memory = "?" if row["added_bytes"] is None else f"{row['added_bytes'] / 1e6:.0f}"
        ratios = "".join(f"{row[key]:7.2f}" if key in row else f"{'':7}" for key in ("ratio", "cpu_ratio"))
        lines.append(f"  {name:10}{row['seconds']:9.3f}{row['cpu_seconds']:9.3f}{ratios}{memory:>7}")
        if row["triangles"] != result["triangles"]:
            lines[-1] += f"   {row['triangles']:.0f} triangles"
    return lines
