"""`clrt compare`: error metrics of an image against another."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("image", type=click.Path(path_type=Path))
@click.argument("reference", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write where they differ: an .exr holds IMAGE - REFERENCE, a .png the relative error from black to white.",
)
def command(image: Path, reference: Path, as_json: bool, output: Path | None) -> None:
    """Compare IMAGE with REFERENCE: relMSE, RMSE, ratio of the means, FLIP, largest difference, non-finite values."""
    from ..output.difference_image import clipping, write_difference
    from ..output.image_error import compare_files
    from ..output.json_text import json_text

    result = compare_files(image, reference)
    if remark := clipping(image, reference):
        click.echo(remark, err=True)
    white = write_difference(output, image, reference) if output else 0.0
    if as_json:
        click.echo(json_text(result))
        return
    if output and white:
        click.echo(f"{output}: relative errors from 0, black, to {white:.3g}, white", err=True)
    for name, value in result.items():
        numbers = value if isinstance(value, list) else [value]
        click.echo(f"{name:20} " + "  ".join("-" if n is None else f"{n:.6g}" for n in numbers))
