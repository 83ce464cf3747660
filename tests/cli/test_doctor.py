"""`clrt doctor` reports everything useful for diagnosis and nothing private."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from clrt.device.discovery.diagnosis import diagnosis, without_names

pytestmark = pytest.mark.processes

PARTS = ["made", "system", "versions", "environment", "drivers", "devices", "cache", "logs"]
SECRET = "hunter2"


def clrt(home: Path, *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Run clrt in the environment of the user jane, which contains a secret."""
    own = {
        "HOME": str(home),
        "USER": "jane",
        "LOGNAME": "jane",
        "CLRT_CACHE_DIR": str(home / "cache"),
        "AWS_SECRET_ACCESS_KEY": SECRET,
        "NVIDIA_API_KEY": SECRET,
    }
    return subprocess.run(
        [sys.executable, "-P", "-m", "clrt", *arguments],
        cwd=home,
        capture_output=True,
        text=True,
        timeout=200,
        env={**os.environ, **own, **more},
    )


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """Return jane's home folder, with logs that name her and the machine."""
    home = tmp_path / "homes" / "jane"
    (home / "cache").mkdir(parents=True)
    (home / "vendors").mkdir()
    (home / "vendors" / "broken.icd").write_text(f"{home}/libbroken.so\n")
    log = f"jane@{socket.gethostname()} {home}/a.cl /home/jack/b.cl: warning\n"
    (home / "cache" / "last-build.log").write_text(log)
    return home


def test_the_pack_holds_all_of_it_and_no_names(home: Path) -> None:
    failed = clrt(home, "render", "nothing.toml", "--device", "no such device", OCL_ICD_VENDORS=str(home / "vendors"))
    assert failed.returncode == 3
    (home / "empty.toml").write_text("[environment]\ncolor = [1, 1, 1]\n[[sphere]]\n")
    failed = clrt(home, "render", "empty.toml", "--device", "no such device", OCL_ICD_VENDORS=str(home / "vendors"))
    assert failed.returncode == 4
    result = clrt(home, "doctor", "-o", "pack.zip", OCL_ICD_VENDORS=str(home / "vendors"))
    assert (result.returncode, result.stdout) == (0, "pack.zip\n"), result.stderr
    with zipfile.ZipFile(home / "pack.zip") as pack:
        texts = {name: pack.read(name).decode() for name in pack.namelist()}
    assert sorted(texts) == ["last-build.log", "last-error.log", "report.json", "report.txt"]
    report = json.loads(texts["report.json"])
    assert list(report) == PARTS and all(f"== {part}\n" in texts["report.txt"] for part in PARTS)
    (broken,) = (driver for driver in report["drivers"] if "broken" in driver["library"])
    assert broken["library"] == "~/libbroken.so" and "cannot be loaded" in broken["fault"]
    assert report["environment"]["OCL_ICD_VENDORS"] == "~/vendors"
    assert "no usable device matches 'no such device'" in texts["last-error.log"]
    assert "nothing.toml" not in texts["last-error.log"], "mistakes in scenes are no matter of drivers"
    assert texts["last-build.log"] == "~@(host) ~/a.cl ~/b.cl: warning\n"
    for text in texts.values():
        for name in ("jane", socket.gethostname(), SECRET):
            assert name not in text


def test_the_report_is_printed_as_text_and_as_json(home: Path) -> None:
    text, printed = clrt(home, "doctor"), clrt(home, "doctor", "--json")
    assert text.returncode == printed.returncode == 0, text.stderr + printed.stderr
    report = json.loads(printed.stdout)
    assert list(report) == PARTS
    assert [row["id"] for row in report["devices"]] and all(
        f"id: {row['id']}\n" in text.stdout for row in report["devices"]
    )
    assert not any("hardware" in row for row in report["devices"])
    assert report["versions"]["numpy"] in text.stdout and report["cache"]["writable"] is True


def test_other_files_are_refused(home: Path) -> None:
    result = clrt(home, "doctor", "-o", "pack.tar")
    assert result.returncode == 2 and ".zip" in result.stderr and not (home / "pack.tar").exists()


def test_what_cannot_be_found_out_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> None:
        raise OSError("no such luck")

    monkeypatch.setattr("clrt.device.discovery.diagnosis._devices", fails)
    assert diagnosis()["devices"] == {"error": "OSError: no such luck"}


def test_words_that_only_contain_a_name_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("USER", "jan")
    monkeypatch.setenv("HOME", "/data/jan")
    assert without_names({"a": ["/data/jan/x", "/data/janet/x", "jan janitor", 7, None, True]}) == {
        "a": ["~/x", "/data/janet/x", "~ janitor", 7, None, True]
    }
