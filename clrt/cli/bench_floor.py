"""`clrt bench floor`: a plastic floor compared with physical models and other renderers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("floor")
@click.option(
    "--light",
    "chosen",
    multiple=True,
    metavar="NAME",
    help="Test only this light: sun above, sun at 60°, point, HDRI, low lamp; may be repeated.",
)
@click.option("--spp", type=click.IntRange(min=1), default=1024, show_default=True, help="Samples per pixel.")
@click.option("--seeds", type=click.IntRange(min=2), default=4, show_default=True, help="Images per renderer.")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@figures_options
def floor_command(chosen: tuple[str, ...], spp: int, seeds: int, device: str | None, json_file: Path | None) -> None:
    """Compare models of a white plastic floor under a sun, a point light, an HDRI with a low sun and a low area light.

    In float64: clrt's model, the same with Fresnel's equations instead of Schlick's approximation, and the latter
    layered by the view direction alone. Then clrt, Mitsuba's roughplastic and principled (pip install mitsuba), and
    Cycles' Principled BSDF (pip install bpy). The values are relative to a white Lambertian floor.
    """
    from ..bench.renderers.plastic_floor import judges, lights, measure_floor
    from ..bench.renderers.plastic_floor_model import MODELS
    from ..errors import UsageError

    if unknown := [name for name in chosen if name not in lights()]:
        raise UsageError(f"--light {unknown[0]}: is unknown; choose from {', '.join(lights())}")
    found, missing = judges(device)
    columns = [*MODELS, *found]
    click.echo(f"{'light':15}{'view':7}{'material':15}" + "".join(f"{name:>17}" for name in columns))
    rows = []
    for row in measure_floor(found, spp, seeds, chosen):
        click.echo(_line(row, columns))
        rows.append(row)
    for name, why in missing.items():
        click.echo(f"  {name}: {why}")
    write_figures(json_file, {"spp": spp, "seeds": seeds, "missing": missing, "rows": rows})


def _line(row: Mapping[str, Any], columns: list[str]) -> str:
    values = ("{:.4f}±{:.4f}".format(*row["values"][name]) for name in columns)
    return f"{row['light']:15}{row['view']:7}{row['material']:15}" + "".join(f"{value:>17}" for value in values)
