"""Fuzzer of the file readers: each damaged file must load or raise one SceneError, in bounded time and memory.

    python -m tests.fuzz 10000                  # 10000 files, made from small seeds that are written here
    python -m tests.fuzz 10000 --seeds FOLDER   # also from the files in a folder
    python -m tests.fuzz 300 --render 10        # also renders every tenth file that loads

File number i is the same in every run. A worker process loads the files; if it crashes or takes too long, a new one
resumes after the file that caused it.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

#: Memory limit of the worker in bytes, beyond which it gets a MemoryError, and time limit per file in seconds.
MEMORY = 4 * 2**30
SECONDS = 30
#: Files larger than this number of bytes are not used as seeds.
LARGEST = 300_000
PICTURES = (".hdr", ".exr", ".png", ".jpg")
FORMATS = (
    ".toml",
    ".glb",
    ".gltf",
    ".obj",
    ".mtl",
    ".ply",
    ".stl",
    ".off",
    ".3mf",
    ".usda",
    ".usdc",
    ".usdz",
    ".xml",
    ".serialized",
    ".pbrt",
    *PICTURES,
)
GOOD = ("picture", "error")
NUMBERS = [
    "-1",
    "0",
    "1",
    "2",
    "255",
    "65536",
    "2147483647",
    "4294967296",
    "99999999999999999999",
    "1e39",
    "1e-40",
    "-1e308",
    "nan",
    "inf",
    "0x10",
    "1.5",
    "",
    "true",
    "null",
    '"x"',
    "[]",
    "{}",
]
VALUES: list[Any] = [
    None,
    -1,
    0,
    1,
    3,
    255,
    2**31,
    2**63,
    1e39,
    1.5,
    True,
    "",
    "x",
    [],
    [0],
    {},
    {"x": 1},
    "../x.bin",
    "data:application/octet-stream;base64,AAAA",
    5121,
    5126,
    "VEC3",
    "SCALAR",
]
BYTES = [
    b"\0",
    b"\xff",
    b"\x7f",
    b"\x80",
    b"\n",
    b" ",
    b"\xff\xff\xff\x7f",
    b"\xff\xff\xff\xff",
    b"\0\0\xc0\x7f",
    b"\0\0\x80\x7f",
    b"\xff\xff\x7f\x7f",
    b"\1\0\0\0",
    b"\0" * 8,
]


Change = Callable[[bytes, random.Random], bytes]


def seeds_in(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix in FORMATS and file.stem != "damaged")


def case(seeds: list[Path], number: int) -> tuple[Path, bytes]:
    """Return the seed and the damaged content of file `number`."""
    rng = random.Random(number)
    seed = seeds[number % len(seeds)]
    content = seed.read_bytes()
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        document = seed.suffix in (".glb", ".gltf") and rng.random() < 0.5
        change = (
            _json
            if document
            else rng.choice(
                (_numbers, _numbers, _cut, _repeated, _overwritten, _overwritten, _flipped, _truncated, _lines)
            )
        )
        inside = content.startswith((b"glTF", b"PK")) and (document or rng.random() < 0.7)
        within = _in_chunk if content.startswith(b"glTF") else _in_archive
        content = within(content, change, rng) if inside else change(content, rng)
    return seed, content


def _in_chunk(content: bytes, change: Change, rng: random.Random) -> bytes:
    """Change the JSON chunk of a .glb file, or its binary chunk in 1 of 4 cases, and correct the chunk lengths."""
    (size,) = struct.unpack_from("<I", content.ljust(16, b"\0"), 12)
    text, rest = content[20 : 20 + size], content[28 + size :]
    if change is not _json and rng.random() < 0.25:
        rest = change(rest, rng)
    else:
        text = change(text, rng)
        text += b" " * (-len(text) % 4)
    return (
        struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(rest), len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(rest), b"BIN\0")
        + rest
    )


def _in_archive(content: bytes, change: Change, rng: random.Random) -> bytes:
    """Change one of the files in a ZIP archive, which are stored without compression."""
    copy = io.BytesIO()
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as given, zipfile.ZipFile(copy, "w") as changed:
            damaged = rng.choice(given.namelist())
            for name in given.namelist():
                file = given.read(name)
                changed.writestr(zipfile.ZipInfo(name), change(file, rng) if name == damaged else file)
    except Exception:  # an archive that an earlier change has damaged
        return content
    return copy.getvalue()


def _place(content: bytes, rng: random.Random) -> int:
    """Return a random position in the content; half of the time in the first 400 bytes, where headers are."""
    return rng.randrange(min(len(content), 400) if rng.random() < 0.5 else len(content)) if content else 0


def _numbers(content: bytes, rng: random.Random) -> bytes:
    """Replace the first number in the text after a random position."""
    start = _place(content, rng)
    new = rng.choice(NUMBERS).encode()
    return content[:start] + re.sub(rb"-?\d+(\.\d+)?", lambda match: new, content[start:], count=1)


def _cut(content: bytes, rng: random.Random) -> bytes:
    start = _place(content, rng)
    return content[:start] + content[start + rng.choice((1, 2, 4, 16, 200)) :]


def _repeated(content: bytes, rng: random.Random) -> bytes:
    start = _place(content, rng)
    return content[:start] + content[start : start + rng.choice((1, 4, 40))] * rng.choice((2, 3, 50)) + content[start:]


def _overwritten(content: bytes, rng: random.Random) -> bytes:
    start, new = _place(content, rng), rng.choice(BYTES)
    return content[:start] + new + content[start + len(new) :]


def _flipped(content: bytes, rng: random.Random) -> bytes:
    flipped = bytearray(content)
    if content:
        flipped[_place(content, rng)] ^= 1 << rng.randrange(8)
    return bytes(flipped)


def _truncated(content: bytes, rng: random.Random) -> bytes:
    return content[: _place(content, rng)]


def _lines(content: bytes, rng: random.Random) -> bytes:
    """Swap two random lines."""
    lines = content.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _json(content: bytes, rng: random.Random) -> bytes:
    """Replace or delete a random value in a glTF document."""
    try:
        document = json.loads(content)
        place, key = rng.choice(list(_places(document)))
    except (ValueError, IndexError):
        return content
    if rng.random() < 0.2:
        del place[key]
    else:
        place[key] = rng.choice(VALUES)
    return json.dumps(document).encode()


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every container of a document with each of its keys."""
    for key in list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield value, key
        yield from _places(value[key])


def outcome(file: Path, render: bool) -> str:
    """Load a file and return the outcome: "picture", "error", or "traceback: " and the details."""
    from clrt.errors import SceneError
    from clrt.formats.images.image_reader import read_picture, read_texels
    from clrt.formats.load_scene import load

    try:
        if file.suffix in PICTURES:
            read_picture(file)
            if file.suffix in (".png", ".jpg"):
                read_texels(file.read_bytes(), file.name)
            return "picture"
        scene = load(file.with_suffix(REFERRING[file.suffix][0]) if file.suffix in REFERRING else file)
        if render:
            from clrt.rendering.renderer import Renderer

            list(Renderer(scene, size=(16, 16), spp=1).passes(spp=1))
        return "picture"
    except SceneError as error:
        return "error" if all("\n" not in problem for problem in error.problems) else f"traceback: lines in {error!r}"
    except Exception:
        return "traceback: " + traceback.format_exc().strip().replace("\n", " | ")


def _give_up(*_: object) -> None:
    traceback.print_stack()
    os._exit(100)


def work(folder: Path, first: int, last: int, render: int) -> None:
    """Run the worker process: print a line "number outcome" for each file."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGALRM, _give_up)
    warnings.simplefilter("error")
    seeds = seeds_in(folder / "seeds")
    loaded = 0
    for number in range(first, last):
        seed, content = case(seeds, number)
        file = folder / "seeds" / f"damaged{seed.suffix}"
        file.write_bytes(content)
        if seed.suffix in REFERRING:
            suffix, text = REFERRING[seed.suffix]
            file.with_suffix(suffix).write_text(text)
        print(number, end=" ", flush=True)
        signal.alarm(SECONDS)
        told = outcome(file, bool(render) and loaded % render == 0)
        signal.alarm(0)
        loaded += told == "picture"
        print(told, flush=True)


def run(
    count: int,
    folder: Path,
    render: int = 0,
    told: Callable[[str], None] = lambda line: None,
) -> dict[str, Counter[str]]:
    """Return the outcomes of files 0 … count − 1 by format, with the seeds in folder/seeds; pass bad ones to `told`."""
    seeds = seeds_in(folder / "seeds")
    results: dict[str, Counter[str]] = {}
    first = 0
    while first < count:
        command = [
            sys.executable,
            "-m",
            "tests.fuzz",
            str(count),
            "--work",
            str(folder),
            str(first),
            "--render",
            str(render),
        ]
        with (
            (folder / "log").open("w+b") as log,
            subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=log, text=True, cwd=Path(__file__).parents[1]
            ) as process,
        ):
            assert process.stdout is not None
            for line in process.stdout:
                number, _, what = line.strip().partition(" ")
                first = int(number) + 1
                suffix = seeds[int(number) % len(seeds)].suffix
                what = what or ("hang" if process.wait() == 100 else f"crash {process.wait()}")
                kind = re.split("[: ]", what)[0]
                results.setdefault(suffix, Counter())[kind] += 1
                if kind not in GOOD:
                    log.seek(0)
                    tail = log.read().decode(errors="replace")[-1500:] if kind in ("hang", "crash") else ""
                    told(f"{number} ({seeds[int(number) % len(seeds)].name}): {what} {tail}")
        if process.returncode and not line:
            raise RuntimeError((folder / "log").read_text())
    return results


OBJ = "mtllib damaged.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 3 2 1\n"
XML = """<scene version="3.0.0"><shape type="serialized"><string name="filename" value="damaged.serialized"/>
<integer name="shape_index" value="1"/></shape></scene>"""
#: For files that only others refer to, the suffix and text of one that does.
REFERRING = {".mtl": (".obj", OBJ), ".serialized": (".xml", XML)}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Loads damaged files of every format.")
    parser.add_argument("count", type=int)
    parser.add_argument("--seeds", type=Path, action="append", default=[], metavar="FOLDER")
    parser.add_argument("--render", type=int, default=0, metavar="K")
    parser.add_argument("--work", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work:
        work(Path(arguments.work[0]), int(arguments.work[1]), arguments.count, arguments.render)
        return
    from .fuzz_seeds import write_seeds

    with tempfile.TemporaryDirectory() as folder:
        write_seeds(Path(folder) / "seeds", arguments.seeds)
        results = run(arguments.count, Path(folder), arguments.render, lambda line: print(line, file=sys.stderr))
    columns = (*GOOD, "traceback", "crash", "hang")
    print(f"{'':10}{'files':>8}" + "".join(f"{column:>11}" for column in columns))
    for suffix in (*sorted(results), None):
        row = sum(results.values(), Counter()) if suffix is None else results[suffix]
        print(f"{suffix or 'all':10}{row.total():8}" + "".join(f"{row[column]:11}" for column in columns))


if __name__ == "__main__":
    main()
