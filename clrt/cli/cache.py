"""`clrt cache`: the cache of compiled programs, device and driver data, and reference images."""

from __future__ import annotations

import click


@click.command()
@click.option("--clear", is_flag=True, help="Delete everything in it.")
def command(clear: bool) -> None:
    """Show or clear the cache: compiled programs, checks and measurements of devices, and reference images.

    All of it is recreated when needed. Drivers have program caches of their own.
    """
    from ..device import cache_files

    sizes = cache_files.sizes()
    click.echo(cache_files.cache_folder())
    for kind, (count, size) in sizes.items():
        if count:
            deleted = f", {cache_files.clear(cache_files.KINDS[kind])} deleted" if clear else ""
            click.echo(f"  {kind:20} {count:6} {size:14_} bytes{deleted}")
    if not any(count for count, _ in sizes.values()):
        click.echo("  empty")
