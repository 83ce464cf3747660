"""`clrt view`: interactive window to walk through a scene and edit it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ..errors import UsageError
from ..scene.render_settings import RenderSettings
from . import PROGRAM
from .guard import guarded
from .interrupt import Interruptible
from .load_options import LoadOptions
from .logs import verbose_option
from .option_groups import grouped, settings_options
from .options import NAMES


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@grouped("loading", LoadOptions)
@settings_options(RenderSettings, NAMES, defaults=False)
@click.option(
    "--device",
    "devices",
    multiple=True,
    metavar="SEL",
    help="Device to use; see `clrt devices`. Repeat to use several.",
)
@click.option("--view", metavar="NAME", help="View transform; see `clrt render`.")
@click.option("--exposure", default=0.0, metavar="EV", help="In stops.")
@verbose_option
def command(
    scene: Path, loading: LoadOptions, devices: tuple[str, ...], view: str | None, exposure: float, **given: Any
) -> None:
    """Show SCENE, a .toml scene or a model, in an interactive window: navigate, edit, watch it refine
    (docs/window.md)."""
    if click.get_current_context().obj == PROGRAM:
        guarded(lambda: "")
    from ..window.needs import check_window

    check_window()
    from ..device.discovery.discover import select
    from ..live.settings import Settings
    from ..output.view_transform import check_view
    from ..scene.fields.field_types import field_problems
    from ..window.app import App, DisplaySettings

    check_view(view or "srgb", exposure)
    for selector in devices or (None,):
        select(selector)
    chosen = {name: value for name, value in given.items() if value is not None}
    if problems := field_problems(RenderSettings, chosen, "render"):
        raise UsageError("\n".join(problems))
    content = loading.load(scene, size=chosen.get("size"))
    content.render = replace(content.render, **chosen)
    app = App(content, Settings(device=devices or None), DisplaySettings(view or content.display.view, exposure))
    with Interruptible(app.close) as interruptible:
        app.run()
    if interruptible.asked:
        sys.exit(130)
