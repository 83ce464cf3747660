"""`clrt relight`: other brightnesses and colors of an image's light groups, without rendering."""

from __future__ import annotations

import os
from pathlib import Path

import click

from ..errors import UsageError
from .option_types import Factors


@click.command()
@click.argument("image", type=click.Path(path_type=Path), metavar="IMAGE.exr")
@click.option(
    "--group",
    "factors",
    type=Factors(),
    multiple=True,
    metavar="NAME=FACTOR",
    help="Multiply the light of a group by a number, or by R,G,B; may be repeated. Others stay as they are.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", required=True, help="Image to write.")
@click.option("--view", default="srgb", show_default=True, metavar="NAME", help="View transform, as of clrt render.")
@click.option("--exposure", default=0.0, metavar="EV", help="Exposure, in stops.")
@click.option("--force", is_flag=True, help="Replace a file that is read-only.")
def command(
    image: Path,
    factors: tuple[tuple[str, tuple[float, ...]], ...],
    output: Path,
    view: str,
    exposure: float,
    force: bool,
) -> None:
    """Mix the light groups of IMAGE.exr, a render with --aov light_groups, and write the result."""
    from ..output.atomic_files import check_unprotected
    from ..output.images import check_writable
    from ..output.relighting import relight

    if os.path.realpath(image) == os.path.realpath(output):
        raise UsageError(f"{output}: is the image with the light groups, which would be lost; choose another file")
    check_writable(output)
    check_unprotected(output, force)
    relight(image, dict(factors)).save(output, view=view, exposure=exposure)
    click.echo(str(output))
