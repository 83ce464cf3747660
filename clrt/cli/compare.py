"""`clrt compare`: error metrics of an image against another."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("image", type=click.Path(path_type=Path))
@click.argument("reference", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
def command(image: Path, reference: Path, as_json: bool) -> None:
    """Compare IMAGE with REFERENCE: relMSE, RMSE, ratio of the means, FLIP, largest difference, non-finite values."""
    from ..output.image_error import compare_files
    from ..output.json_text import json_text

    result = compare_files(image, reference)
    if as_json:
        click.echo(json_text(result))
        return
    for name, value in result.items():
        numbers = value if isinstance(value, list) else [value]
        click.echo(f"{name:20} " + "  ".join("-" if n is None else f"{n:.6g}" for n in numbers))
