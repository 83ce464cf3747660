"""`clrt convert`: a model, or a Mitsuba or pbrt scene, to a scene file as a starting point."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import UsageError
from .load_options import LoadOptions
from .option_groups import grouped
from .option_types import Size


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("scene", type=click.Path(path_type=Path), metavar="SCENE.toml")
@grouped("loading", LoadOptions)
@click.option("--size", type=Size(), help="Image size of the scene, in which the camera frames a bare model.")
@click.option("--force", is_flag=True, help="Replace existing files, including read-only ones.")
def command(model: Path, scene: Path, loading: LoadOptions, size: tuple[int, int] | None, force: bool) -> None:
    """Write SCENE.toml, which renders like `clrt render MODEL` in the same size, with its camera, sky, lights and
    materials to edit.

    MODEL is a model, or a Mitsuba (.xml) or pbrt scene (.pbrt).
    """
    from ..formats.toml.writer import started
    from ..output.atomic_files import check_target
    from ..output.scenes import save_scene

    if scene.suffix.lower() != ".toml":
        raise UsageError(f"{scene}: a scene file's name must end in .toml; write {scene.with_suffix('.toml')}")
    if model.suffix.lower() == ".toml":
        raise UsageError(f"{model}: is already a scene file; give a model file")
    if scene.exists() and not force:
        raise UsageError(f"{scene}: already exists; choose another file, or replace it with --force")
    check_target(scene)
    save_scene(started(loading.load(model, size=size)), scene, force=force)
    click.echo(str(scene))
