"""Results are kept elsewhere if their folder disappears or becomes unwritable during the render."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest

from clrt.cli.outputs import Outputs
from clrt.errors import KeptBesideError, OutputError
from clrt.output.image import Image
from clrt.output.images import EXTENSIONS, read_image

PIXELS = np.random.default_rng(3).random((6, 8, 3)).astype(np.float32)
RAW = PIXELS[::-1].copy()
DEPTH = np.full((6, 8), 2, np.float32)


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Return the fallback folders, in order of preference."""
    found = [tmp_path / name for name in ("working", "home", "temporary")]
    for folder in found:
        folder.mkdir()
    monkeypatch.chdir(found[0])
    monkeypatch.setenv("HOME", str(found[1]))
    monkeypatch.setattr(tempfile, "tempdir", str(found[2]))
    return found


def outputs_in(folder: Path) -> Outputs:
    """Return the checked outputs of an image, in all formats."""
    folder.mkdir()
    asked = Outputs(
        (),
        tuple(folder / f"a{suffix}" for suffix in EXTENSIONS),
        ("depth",),
        True,
        "srgb",
        0.0,
        folder / "r.json",
        None,
    )
    asked.check()
    return asked


@pytest.mark.parametrize("lost", [0, 1, 2, 3], ids=["none", "working", "home", "all"])
def test_each_result_is_kept_once(places: list[Path], tmp_path: Path, lost: int) -> None:
    """Results go to the first existing folder, and the error names them; without any folder it names none."""
    asked = outputs_in(tmp_path / "asked")
    for folder in (tmp_path / "asked", *places[:lost]):
        shutil.rmtree(folder)
    with pytest.raises(OutputError) as caught:
        asked.save_frame(Image(PIXELS, {"spp": 3}, raw=RAW, aovs={"depth": DEPTH}))
    kept = [path for folder in places[lost:] for path in folder.iterdir()]
    assert all(path.parent == places[lost] for path in kept)
    if lost == len(places):
        assert "instead" not in str(caught.value)
        return
    by_ending = {"".join(path.suffixes): path for path in kept if ".raw-" not in path.name}
    beside = {f".depth{suffix}" for suffix in EXTENSIONS if suffix not in (".exr", ".hdr")}
    assert set(by_ending) == {*EXTENSIONS, *beside, ".json"} and len(kept) == 2 * len(EXTENSIONS) + len(beside) + 1
    assert np.array_equal(read_image(by_ending[".exr"]), PIXELS)
    assert np.array_equal(read_image(next(places[lost].glob("a.raw-*.exr"))), RAW)
    assert json.loads(by_ending[".json"].read_text()) == {"spp": 3}
    assert all(str(path) in str(caught.value) for path in kept if ".depth" not in path.suffixes)


def test_what_is_beside_already_is_not_kept_twice(
    places: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = outputs_in(tmp_path / "asked")

    def refuse(*arguments: object) -> None:
        raise KeptBesideError("it is a-1.png beside it")

    monkeypatch.setattr("clrt.output.atomic_files._move", refuse)
    with pytest.raises(OutputError, match="a-1.png beside it"):
        asked.save_frame(Image(PIXELS))
    assert not [*places[0].iterdir()]
