"""`clrt bench blender`: scenes built in Blender, rendered by clrt and by Cycles."""

from __future__ import annotations

from pathlib import Path

import click

from .bench_files import figures_options, write_figures


@click.command("blender")
@click.argument("scenes", nargs=-1, metavar="[SCENE]...")
@click.option(
    "--material",
    "materials",
    multiple=True,
    metavar="NAME",
    help="Test only this material: matte, bumps, metal, glass, plastic, all; may be repeated.",
)
@click.option("--spp", type=click.IntRange(min=1), default=64, show_default=True, help="Samples per pixel.")
@click.option("--seeds", type=click.IntRange(min=2), default=4, show_default=True, help="Images per renderer.")
@click.option(
    "--pictures",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write clrt's and Cycles' images there, side by side, as PNG.",
)
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@figures_options
def blender_command(
    scenes: tuple[str, ...],
    materials: tuple[str, ...],
    spp: int,
    seeds: int,
    pictures: Path | None,
    device: str | None,
    json_file: Path | None,
) -> None:
    """Build scenes in Blender (pip install bpy), export them as glTF, and compare clrt's images with Cycles'.

    SCENE is a kind of light: spot, area, sun, delta_sun, point, emission, HDRI, or together; default: all of them. The
    values are the mean radiances of the floor, Suzanne, the sphere and the cube in clrt, divided by those in Cycles,
    with standard errors.
    """
    from ..bench.renderers.blender import judge
    from ..bench.renderers.blender_scenes import COLORS
    from ..output.image import save_side_by_side

    rows = []
    found = judge(scenes, materials, spp, seeds, device)
    click.echo(f"{'scene':11}{'material':9}" + "".join(f"{name:>15}" for name in COLORS))
    for judged in found:
        values = (f"{judged.ratios[name]:.4f}±{judged.errors[name]:.4f}" for name in COLORS)
        click.echo(f"{judged.scene:11}{judged.material:9}" + "".join(f"{value:>15}" for value in values))
        rows.append(
            {"scene": judged.scene, "material": judged.material, "ratios": judged.ratios, "errors": judged.errors}
        )
        if pictures is not None:
            save_side_by_side(pictures / f"{judged.scene}_{judged.material}.png", judged.images.values())
    write_figures(json_file, {"spp": spp, "seeds": seeds, "rows": rows})
