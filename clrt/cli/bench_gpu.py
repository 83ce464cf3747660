"""`clrt bench gpu`: everything that matters of a device, measured in a few minutes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from ..errors import OutputError
from .bench_files import check_files
from .option_types import Finite


@click.command("gpu")
@click.argument("scenes", nargs=-1, type=click.Path(exists=True, path_type=Path), metavar="[SCENE...]")
@click.option("--device", metavar="SEL", help="Device to measure; see `clrt devices`.")
@click.option(
    "--minutes", type=Finite(0.0), default=8.0, show_default=True, help="Time for all parts; each gets its share."
)
@click.option("--quick", is_flag=True, help="Use tiny images, meshes and few rays, as for a simulator.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default="gpu.zip",
    show_default=True,
    metavar="FILE.zip",
    help="File with the results, gpu.json, and a page that shows them, gpu.html. An earlier one is completed.",
)
@click.option("--fresh", is_flag=True, help="Measure everything again, and replace the file.")
@click.option("--force", is_flag=True, help="Replace a file that is read-only.")
def gpu_command(
    scenes: tuple[Path, ...], device: str | None, minutes: float, quick: bool, output: Path, fresh: bool, force: bool
) -> None:
    """Check and measure a device: its hits and images against another device's, rays and samples per second of every
    variant, work-group sizes, BVH builds, frame rates, compile times, and other renderers if installed.

    SCENE: instead of the gallery's scenes. Each part runs in a process of its own, so one that fails, hangs or crashes
    its driver is recorded, and the others follow. A second run completes what time did not suffice for.
    """
    from ..bench.gpu.archive import read_archive
    from ..bench.gpu.measure_gpu import begin, measure_gpu, resumed
    from ..bench.gpu.page import page_of
    from ..bench.gpu.shipped_scenes import shipped_scenes

    check_files({"output": output, "scenes": scenes}, force)
    results = resumed(begin(device, quick=quick), None if fresh else read_archive(output), output)
    click.echo(f"{results['device']['name']} ({results['device']['platform']})", err=True)
    try:
        measure_gpu(
            results,
            scenes or shipped_scenes(),
            60 * minutes,
            on_item=lambda part, item: click.echo(f"{part}: {item}", err=True),
            on_part=lambda part: _told(results, part, output),
        )
    finally:
        _write(output, results, page_of(results))
    click.echo(str(output))


def _told(results: Mapping[str, Any], part: str, output: Path) -> None:
    """Write the results so far, and print a line about a part."""
    from ..bench.gpu.summary import summary_line

    _write(output, results)
    click.echo(summary_line(part, results["parts"][part]))


def _write(output: Path, results: Mapping[str, Any], page: str | None = None) -> None:
    """Write the results, if necessary to a fallback location, which the error then names."""
    from ..bench.gpu.archive import write_archive
    from .fallback import kept_elsewhere

    try:
        write_archive(output, results, page)
    except OutputError as error:
        raise kept_elsewhere(error, output, lambda other: write_archive(other, results, page)) from error
