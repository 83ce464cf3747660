"""`clrt cache`: where compiled programs, what checks of devices found, and reference pictures are kept."""

from __future__ import annotations

import click


@click.command()
@click.option("--clear", is_flag=True, help="Delete them.")
def command(clear: bool) -> None:
    """Show the folder of compiled programs, devices' checks and reference pictures, or clear it."""
    from ..device import cache, verdicts

    folder = cache.cache_folder()
    if clear:
        click.echo(f"{folder}: {cache.clear()} programs, {cache.clear(cache.REFERENCES)} references and "
                   f"{verdicts.forget_verdicts()} checks deleted")
        return
    stored = list(folder.glob("*.bin"))
    click.echo(f"{folder}: {len(stored)} programs, {sum(file.stat().st_size for file in stored)} bytes")
