"""`clrt cache`: where compiled programs, and what checks of devices found, are kept."""

from __future__ import annotations

import click


@click.command()
@click.option("--clear", is_flag=True, help="Delete them.")
def command(clear: bool) -> None:
    """Show the folder of compiled programs and of devices' checks, or clear it."""
    from ..device import cache, verdicts

    folder = cache.cache_folder()
    if clear:
        click.echo(f"{folder}: {cache.clear()} programs and {verdicts.forget_verdicts()} checks deleted")
        return
    stored = list(folder.glob("*.bin"))
    click.echo(f"{folder}: {len(stored)} programs, {sum(file.stat().st_size for file in stored)} bytes")
