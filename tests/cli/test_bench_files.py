"""Output files of experiments are checked before the experiment begins."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from clrt.cli.bench import command as bench
from clrt.cli.bench_files import FILES, FOLDERS, figures_options, write_figures
from clrt.errors import ClrtError, OutputError, UsageError

CALLED: list[Path | None] = []


@click.command()
@click.option("--mesh", "meshes", multiple=True, type=click.Path(path_type=Path))
@click.option("--pictures", type=click.Path(path_type=Path))
@figures_options
@click.option("--plot", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(path_type=Path))
def experiment(json_file: Path | None, **others: object) -> None:
    """Experiment that only records that it was begun."""
    CALLED.append(json_file)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    CALLED.clear()
    (tmp_path / "a.obj").touch()
    (tmp_path / "old.svg").touch(0o444)
    os.mkfifo("pipe.svg")
    return tmp_path


def call(arguments: Iterable[str]) -> Result:
    return CliRunner().invoke(experiment, list(arguments), standalone_mode=False)


@pytest.mark.parametrize("option", FILES.values())
@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("no/such/f.svg", OutputError),
        (".", OutputError),
        ("old.svg", OutputError),
        ("pipe.svg", OutputError),
        ("a.obj", UsageError),
        ("./a.obj", UsageError),
    ],
)
def test_nothing_is_begun_in_vain(option: str, path: str, kind: type[ClrtError]) -> None:
    """Refused if the folder is missing, or the file is a folder, read-only, a pipe, or an input of the experiment."""
    result = call(["--mesh", "b.obj", "--mesh", "a.obj", option, path])
    assert type(result.exception) is kind and str(Path(path)) in str(result.exception) and not CALLED


def test_one_file_twice() -> None:
    assert isinstance(call(["--json", "a.svg", "--plot", "a.svg"]).exception, UsageError) and not CALLED


def test_what_is_begun(folder: Path) -> None:
    """Read-only files are accepted with --force; folders for images are created at the start."""
    for arguments in (
        ["--json", "new.json", "--plot", "new.svg"],
        ["--json", "old.svg", "--force"],
        ["--pictures", "some/where"],
        [],
    ):
        result = call(["--mesh", "a.obj", *arguments])
        assert result.exception is None, result.exception
    assert CALLED == [Path("new.json"), Path("old.svg"), None, None] and (folder / "some/where").is_dir()
    assert isinstance(call(["--pictures", "a.obj/x"]).exception, OutputError)


@pytest.mark.parametrize("name", sorted(bench.commands))
def test_every_experiment_is_checked(name: str) -> None:
    """File options of every experiment have the names that the check knows."""
    each = bench.commands[name]
    options = {option: parameter.name for parameter in each.params for option in parameter.opts}
    assert (options.get("--json") == "json_file" or "--output" in options) and "--force" in options
    assert all(options.get(option) in (name, None) for name, option in FILES.items())
    folders = {
        parameter.name
        for parameter in each.params
        if parameter.metavar == "DIR" and isinstance(parameter, click.Option)
    }
    assert folders <= set(FOLDERS)


def test_figures_are_not_lost(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path_factory.mktemp("gone")
    shutil.rmtree(gone)
    with pytest.raises(OutputError, match="written to .* instead"):
        write_figures(gone / "f.json", {"a": 1})
    (kept,) = folder.glob("f-*.json")
    assert json.loads(kept.read_text()) == {"a": 1} and capsys.readouterr().out == ""
    write_figures(Path("f.json"), {"a": 2})
    assert json.loads(Path("f.json").read_text()) == {"a": 2} and capsys.readouterr().out == "f.json\n"
