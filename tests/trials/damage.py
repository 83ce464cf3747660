"""Checkpoints truncated, with a flipped bit, of another version or scene, and on a disk that fills up."""

from __future__ import annotations

import logging
import random
import resource
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import clrt
from clrt.errors import CheckpointError
from clrt.rendering.checkpoint.checkpoint_file import MAGIC, older, read_checkpoint
from clrt.rendering.checkpoint.saved_state import KINDS
from clrt.rendering.renderer import Renderer

from ..cli.test_checkpoints import worker_of
from .renders import CORNELL, GALLERY, await_rendering, start

TIMES = 100
DISKS = 20
SIZE, SPP = (48, 48), 8
Damage = Callable[[bytes, random.Random], bytes]
#: Damage applied to the newer of two generations, or to both.
DAMAGES: dict[str, Damage] = {
    "cut": lambda content, rng: content[: rng.randrange(len(content))],
    "a bit flipped": lambda content, rng: _flipped(content, rng.randrange(len(content)), 1 << rng.randrange(8)),
    "old version": lambda content, rng: content.replace(MAGIC, MAGIC.replace(b"3", b"1"), 1),
}


def _flipped(content: bytes, place: int, bit: int) -> bytes:
    return content[:place] + bytes([content[place] ^ bit]) + content[place + 1 :]


def trial() -> Iterator[str]:
    logging.disable(logging.WARNING)  # one per damage
    rng = random.Random(3)
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "a.ck"
        whole = ended(path, resume=False)
        again = ended(path, resume=True)
        assert whole == again and older(path).exists()
        contents = path.read_bytes(), older(path).read_bytes()
        for what, damage in DAMAGES.items():
            for both in (False, True):
                met: Counter[str] = Counter()
                for _ in range(TIMES):
                    path.write_bytes(damage(contents[0], rng))
                    older(path).write_bytes(damage(contents[1], rng) if both else contents[1])
                    met[outcome(path, whole)] += 1
                yield f"{what + (', both' if both else ''):24}" + ", ".join(f"{n} {how}" for how, n in met.items())
        path.write_bytes(contents[0])
        yield f"{'of another scene':24}" + ", ".join(f"{scene.stem} {outcome(path, whole, scene)}" for scene in GALLERY)
    yield f"a disk that fills up: {sum(filled_up(rng) for _ in range(DISKS))} of {DISKS} lost nothing"


def ended(path: Path, resume: bool, scene: Path = CORNELL) -> bytes:
    renderer = Renderer(clrt.load(scene), size=SIZE, spp=SPP, checkpoint=path, resume=resume, checkpoint_seconds=0)
    for spp in (2, SPP):
        for state in renderer.passes(spp=spp):
            pass
    return state.film.pixels.tobytes()


def outcome(path: Path, whole: bytes, scene: Path = CORNELL) -> str:
    """Return the outcome of resuming from the checkpoint."""
    try:
        return "went on to the same film" if ended(path, True, scene) == whole else "WENT ON TO ANOTHER FILM"
    except CheckpointError:
        return "refused"


def filled_up(rng: random.Random) -> bool:
    """Return whether a render with limited file sizes warned, ended, and kept a valid checkpoint."""
    name = tempfile.mkdtemp()
    folder, limit = Path(name), rng.randrange(200_000, 3_000_000)
    options = (CORNELL, "--size", "256x192", "--checkpoint", "a.ck", "--checkpoint-every", 0, "--progress", "json")
    start(folder, *options, "--spp", 1, "-o", "a.exr").communicate()
    process = start(folder, *options, "--spp", 64, "--resume", "-o", "a.png")
    await_rendering(process)
    resource.prlimit(worker_of(process), resource.RLIMIT_FSIZE, (limit, limit))
    _, messages = process.communicate(timeout=600)
    film = read_checkpoint(folder / "a.ck", KINDS)[1]["film"]
    shutil.rmtree(name)
    return "checkpoint cannot be written" in messages and "Traceback" not in messages and film["count"].min() >= 1
