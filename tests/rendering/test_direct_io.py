"""Files written with direct I/O hold the same bytes, for any lengths and on any system that rejects it."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from clrt.rendering.checkpoint.direct_io import CHUNK, write_past_cache

LENGTHS = [[], [0, 1], [CHUNK], [3, CHUNK - 3], [CHUNK + 1], [5, 0, 2 * CHUNK + 7, 100], [4096, 4096, 13]]
#: The temporary folder, and one in memory if there is one, which may not support direct I/O.
FOLDERS = [folder for folder in (Path(tempfile.gettempdir()), Path("/dev/shm")) if os.access(folder, os.W_OK)]


def written(folder: Path, pieces: list[bytes]) -> bytes:
    path = folder / f"clrt-{os.getpid()}-written"
    try:
        with open(path, "wb", buffering=0) as file:
            write_past_cache(file.fileno(), pieces)
            assert os.lseek(file.fileno(), 0, os.SEEK_CUR) == sum(map(len, pieces))
        return path.read_bytes()
    finally:
        path.unlink()


@pytest.mark.parametrize("folder", FOLDERS, ids=str)
@pytest.mark.parametrize("lengths", LENGTHS, ids=str)
def test_the_file_holds_the_pieces(folder: Path, lengths: list[int]) -> None:
    random = np.random.default_rng(len(lengths))
    pieces = [random.bytes(length) for length in lengths]
    assert written(folder, pieces) == b"".join(pieces)


@pytest.mark.skipif(not hasattr(os, "O_DIRECT"), reason="this system has no such writes")
def test_systems_that_refuse_only_when_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Some systems accept O_DIRECT and then fail to write; some reject the flag."""
    import fcntl

    write, direct = os.write, list[bool]()

    def refusing(handle: int, data: memoryview) -> int:
        direct.append(bool(fcntl.fcntl(handle, fcntl.F_GETFL) & os.O_DIRECT))
        if direct[-1]:
            raise OSError(errno.EINVAL, "Invalid argument")
        return write(handle, data)

    monkeypatch.setattr(os, "write", refusing)
    pieces = [bytes(range(256)) * (CHUNK // 128)]
    assert written(tmp_path, pieces) == pieces[0] and direct in ([True, False, False], [False, False])


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no full disk at hand")
@pytest.mark.parametrize("length", [10, 2 * CHUNK])
def test_a_full_disk_is_told(length: int) -> None:
    with open("/dev/full", "wb", buffering=0) as file, pytest.raises(OSError) as error:
        write_past_cache(file.fileno(), [bytes(length)])
    assert error.value.errno == errno.ENOSPC
