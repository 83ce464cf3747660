"""`clrt cache`: where compiled programs are kept."""

from __future__ import annotations

import click


@click.command()
@click.option("--clear", is_flag=True, help="Delete them.")
def command(clear: bool) -> None:
    """Show the folder of compiled programs, or clear it."""
    from ..device import cache

    folder = cache.cache_folder()
    if clear:
        click.echo(f"{folder}: {cache.clear()} programs deleted")
        return
    stored = list(folder.glob("*.bin"))
    click.echo(f"{folder}: {len(stored)} programs, {sum(file.stat().st_size for file in stored)} bytes")
