"""`clrt bench`: experiments, each with its results as a table and as JSON."""

from __future__ import annotations

import click

from .bench_agree import agree_command
from .bench_blender import blender_command
from .bench_build import build_command
from .bench_combinations import combinations_command
from .bench_converge import converge_command
from .bench_farm import farm_command
from .bench_floor import floor_command
from .bench_gpu import gpu_command
from .bench_gpu_code import gpu_code_command
from .bench_hits import hits_command
from .bench_load import load_command
from .bench_mitsuba_data import mitsuba_data_command
from .bench_numerics import numerics_command
from .bench_peers import peers_command
from .bench_poses import poses_command
from .bench_rays import rays_command
from .bench_render_fidelity import render_fidelity_command
from .bench_simt import simt_command
from .bench_theses import theses_command
from .command_group import CommandGroup


@click.group(cls=CommandGroup)
def command() -> None:
    """Measure speed and accuracy: rays, build, hits, peers, load, converge, agree, combinations, floor,
    blender, poses, mitsuba-data, render-fidelity, numerics, theses, farm, gpu, gpu-code, simt."""


for each in (
    rays_command,
    build_command,
    hits_command,
    peers_command,
    load_command,
    converge_command,
    agree_command,
    combinations_command,
    floor_command,
    blender_command,
    poses_command,
    mitsuba_data_command,
    render_fidelity_command,
    numerics_command,
    theses_command,
    farm_command,
    gpu_command,
    simt_command,
    gpu_code_command,
):
    command.add_command(each)
