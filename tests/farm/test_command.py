"""The command on a local cluster writes the same files, and opens no ports to other machines."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest

import clrt
from clrt.errors import DeviceError, UsageError
from clrt.farm.cluster import connect, local_cluster
from clrt.farm.farm_renderer import FarmRenderer
from clrt.output.images import read_image

from ..rendering.checkpoints import run
from ..rendering.test_noise import room

CORNELL = Path(__file__).parents[2] / "scenes" / "cornell.toml"


def command(folder: Path, *arguments: str) -> list[str]:
    """Return the words that it writes to standard output."""
    done = subprocess.run(
        [sys.executable, "-m", "clrt", "render", str(CORNELL), "--size", "32x24", "--spp", "4", "-q", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_frames_of_a_turntable(tmp_path: Path) -> None:
    """Existing frames are not rendered again, whether or not a farm rendered them."""
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    frames = ("--turntable", "4", "-o", "a.exr")
    command(here, *frames)
    (there / "a_0001.exr").write_bytes((here / "a_0001.exr").read_bytes())
    written = command(there, *frames, "--local-cluster", "2", "--resume")
    assert sorted(written) == ["a_0000.exr", "a_0002.exr", "a_0003.exr"]
    for number in range(4):
        name = f"a_000{number}.exr"
        np.testing.assert_array_equal(read_image(there / name), read_image(here / name))


def test_nothing_listens_to_others() -> None:
    """All ports of two workers and the scheduler are on the loopback interface, and connecting without the certificate
    fails."""
    with local_cluster(2) as cluster:
        found = FarmRenderer(room(), cluster, size=(32, 24), spp=8)
        found.session.dispatch.wait_for(2)
        own = psutil.Process()
        ports = [
            port
            for process in [own, *own.children(recursive=True)]
            for port in process.net_connections("inet")
            if port.status == psutil.CONN_LISTEN
        ]
        assert len(ports) >= 3 and {port.laddr.ip for port in ports} == {"127.0.0.1"}
        with pytest.raises(DeviceError, match="does not answer"):
            connect(cluster.address.replace("tls://", "tcp://"))
        image = run(found, spp=8)
    np.testing.assert_array_equal(image.pixels, clrt.render(room(), size=(32, 24), spp=8).pixels)


def test_wrong_addresses() -> None:
    with pytest.raises(UsageError, match="is not an address; write tcp://HOST:PORT"):
        connect("localhost")


def test_dask_is_loaded_where_it_is_used() -> None:
    program = (
        "import sys, clrt.cli.render, clrt.rendering.renderer; "
        "sys.exit(bool({'dask', 'distributed'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0
