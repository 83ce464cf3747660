"""`clrt devices`: the OpenCL devices of this machine, best first."""

from __future__ import annotations

import json

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list.")
def command(as_json: bool) -> None:
    """List the OpenCL devices, best first; * marks the one used when none is named."""
    from ..device.discover import devices

    found = devices()
    if as_json:
        click.echo(json.dumps(found, indent=1))
        return
    if not found:
        click.echo('no OpenCL device; `pip install "pyopencl[pocl]"` brings one that runs on the CPU')
    for device in found:
        mark = "*" if device["chosen"] else " "
        click.echo(f"{mark} {device['index']}  {device['id']}  {device['type']:11}  {device['name']}")
        click.echo(f"     {device['platform']}, {device['platform_version']}, driver {device['driver']}; "
                   f"{device['compute_units']} compute units, {device['global_bytes'] / 2**30:.1f} GiB")
        click.echo(f"     {'usable' if device['usable'] else 'not usable'}: {device['why']}")
