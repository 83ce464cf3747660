"""`clrt cache`: where compiled programs, what is known of devices and drivers, and reference pictures are kept."""

from __future__ import annotations

import click


@click.command()
@click.option("--clear", is_flag=True, help="Delete them.")
def command(clear: bool) -> None:
    """Show the folder of compiled programs, what is known of devices, and reference pictures, or clear it."""
    from ..device import cache, platforms, speeds, verdicts

    folder = cache.cache_folder()
    if clear:
        probes, measured = (cache.clear(f"*.{kind}") for kind in (platforms.KIND, speeds.KIND))
        click.echo(f"{folder}: {cache.clear()} programs, {cache.clear(cache.REFERENCES)} references, {probes} probes "
                   f"of drivers, {measured} speeds and {verdicts.forget_verdicts()} checks deleted")
        return
    stored = list(folder.glob("*.bin"))
    click.echo(f"{folder}: {len(stored)} programs, {sum(file.stat().st_size for file in stored)} bytes")
