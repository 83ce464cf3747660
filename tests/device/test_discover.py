"""Devices are found, ranked and selected; a selector finds the intended device or raises an error that lists them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from clrt.device.device_info import DeviceInfo
from clrt.device.discovery import discover
from clrt.device.discovery.discover import choose, devices, find_devices
from clrt.device.open import Device, open_device
from clrt.device.pocl import cpu_name
from clrt.errors import ClrtError, DeviceError, UsageError

#: The real function, which tests replace.
find_all = find_devices
FIELDS = [
    "index",
    "id",
    "name",
    "platform",
    "platform_version",
    "driver",
    "type",
    "compute_units",
    "global_bytes",
    "max_alloc_bytes",
    "usable",
    "why",
    "chosen",
]

MACHINE = [
    ("NVIDIA H200", "gpu"),
    ("NVIDIA H200", "gpu"),
    ("Radeon RX 9070", "gpu"),
    ("pthread-EPYC", "cpu"),
    ("Oclgrind Simulator", "simulator"),
]


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[DeviceInfo]:
    """Five fake devices: two are alike, and the third is unusable."""
    (tmp_path / "nothing.toml").touch()
    own = find_devices()[0]
    infos = [
        replace(
            own[0],
            index=i,
            id=f"{i}a{i}b",
            name=name,
            type=kind,
            platform=f"{name.split()[0]} OpenCL",
            chosen=i == 0,
            usable=i != 2,
            why="its driver has no compiler" if i == 2 else "fine",
        )
        for i, (name, kind) in enumerate(MACHINE)
    ]
    monkeypatch.setattr(discover, "find_devices", lambda: [(info, own[1]) for info in infos])
    monkeypatch.delenv("CLRT_DEVICE", raising=False)
    monkeypatch.setenv("CLRT_CONFIG", str(tmp_path / "nothing.toml"))
    return infos


@pytest.mark.parametrize(
    ("selector", "index"),
    [
        (None, 0),
        (1, 1),
        ("1", 1),
        (" 3 ", 3),
        ("3a3b", 3),
        ("gpu", 0),
        ("GPU", 0),
        ("cpu", 3),
        ("epyc", 3),
        ("oclgrind", 4),
        ("Simulator", 4),
        ("epyc opencl", 3),
    ],
)
def test_selectors(machine: list[DeviceInfo], selector: str | int | None, index: int) -> None:
    """A number, an id, a type, or part of a device name in any case, otherwise of a platform name."""
    assert choose(selector)[0] is machine[index]


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("h200", "2 devices match 'h200'.*0a0b.*1a1b"),
        ("quadro", "no usable device matches 'quadro'.*Radeon"),
        ("7", "no usable device matches '7'"),
        ("radeon", "Radeon RX 9070 cannot be used: its driver has no compiler"),
        (2, "cannot be used"),
    ],
)
def test_wrong_selectors_list_the_devices(machine: list[DeviceInfo], selector: str | int, words: str) -> None:
    with pytest.raises(DeviceError, match=f"(?s){words}"):
        choose(selector)


def test_a_kind_is_of_devices_alone(machine: list[DeviceInfo], monkeypatch: pytest.MonkeyPatch) -> None:
    """A platform's name does not make its CPU device match "gpu"."""
    own = replace(machine[3], platform="GPU and CPU Runtime")
    monkeypatch.setattr(discover, "find_devices", lambda: [(own, None)])
    with pytest.raises(DeviceError, match="no usable device matches 'gpu'"):
        choose("gpu")


def test_simulators_are_used_only_if_named(machine: list[DeviceInfo], monkeypatch: pytest.MonkeyPatch) -> None:
    """Even if no other device is usable; named by an option, the variable or the configuration file."""
    only = [(machine[2], None), discover.find_devices()[4]]
    monkeypatch.setattr(discover, "_everything", lambda again: only)
    monkeypatch.setattr(discover, "find_devices", find_all)
    assert [(info.type, info.chosen) for info, _ in find_all()] == [("simulator", False), ("gpu", False)]
    with pytest.raises(DeviceError, match="(?s)only a simulator.*Oclgrind Simulator"):
        choose()
    for selector in ("gpu", "cpu"):
        with pytest.raises(DeviceError):
            choose(selector)
    assert choose("oclgrind")[0].type == choose(0)[0].type == "simulator"
    monkeypatch.setenv("CLRT_DEVICE", "simulator")
    assert choose()[0].type == "simulator"


def test_environment_variable(machine: list[DeviceInfo], monkeypatch: pytest.MonkeyPatch) -> None:
    """CLRT_DEVICE replaces a missing selector; an empty value is ignored."""
    monkeypatch.setenv("CLRT_DEVICE", "epyc")
    assert choose()[0] is machine[3]
    assert choose("0")[0] is machine[0]
    monkeypatch.setenv("CLRT_DEVICE", "")
    assert choose()[0] is machine[0]


def test_configuration_file(machine: list[DeviceInfo], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The file's device is used without a selector and variable; without the file, the best device is used."""
    file = tmp_path / "config.toml"
    monkeypatch.setenv("CLRT_CONFIG", "")
    monkeypatch.setattr("platformdirs.user_config_dir", lambda name: str(tmp_path))
    assert choose()[0] is machine[0], "there need be none"
    monkeypatch.setenv("CLRT_CONFIG", str(file))
    with pytest.raises(UsageError, match="config.toml: CLRT_CONFIG names this file"):
        choose()
    for content, chosen in (
        ('device = "epyc"', 3),
        ("device = 0", 0),
        ('device = "cpu"', 3),
        ('device = ""', 0),
        ("# nothing", 0),
    ):
        file.write_text(content)
        assert choose()[0] is machine[chosen]
    file.write_text('device = "epyc"')
    assert choose("0")[0] is machine[0]
    monkeypatch.setenv("CLRT_DEVICE", "0")
    assert choose()[0] is machine[0]


@pytest.mark.parametrize(
    ("content", "error", "words"),
    [
        (b'device = "quadro"', DeviceError, r"no usable device matches 'quadro' \(.*config.toml\).*Radeon"),
        (b"device = [0]", UsageError, "config.toml: device is \\[0\\]"),
        (b"device = true", UsageError, "device is True"),
        (b"device = gpu", UsageError, "config.toml: is not valid TOML"),
        (b"\xff", UsageError, "config.toml: is not valid TOML"),
        (b'devise = "gpu"', UsageError, "config.toml: devise is unknown; the only key is"),
    ],
)
def test_mistakes_in_the_configuration_file(
    machine: list[DeviceInfo],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    content: bytes,
    error: type[ClrtError],
    words: str,
) -> None:
    (tmp_path / "config.toml").write_bytes(content)
    monkeypatch.setenv("CLRT_CONFIG", str(tmp_path / "config.toml"))
    with pytest.raises(error, match=f"(?s){words}"):
        choose()


def test_no_device_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(discover, "find_devices", lambda: [])
    with pytest.raises(DeviceError, match="pip install"):
        choose()


def test_this_machines_devices() -> None:
    """The list is sorted best first, has one chosen device and every field, and is JSON; ids distinguish drivers."""
    listed = devices()
    assert listed and all(
        [name for name in device if name not in ("hardware", "known_faults")] == FIELDS for device in listed
    )
    assert [device["index"] for device in listed] == list(range(len(listed)))
    assert [device["chosen"] for device in listed] == [True] + [False] * (len(listed) - 1)
    usable = [device["usable"] for device in listed]
    assert usable == sorted(usable, reverse=True)
    identities = [(d["platform"], d["platform_version"], d["name"], d["driver"]) for d in listed]
    assert len({device["id"] for device in listed}) == len(set(identities))
    assert json.loads(json.dumps(listed)) == listed


def test_the_one_that_is_preferred_is_chosen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The variable's device is chosen among three equal ones, else the file's; none if no device matches."""
    own = find_devices()[0][1]
    monkeypatch.setattr(discover, "load_platforms", lambda again: ([None], {}))
    monkeypatch.setattr(discover, "devices_of", lambda platform: 3 * [own])
    monkeypatch.setenv("CLRT_CONFIG", str(tmp_path / "config.toml"))
    (tmp_path / "config.toml").write_text("device = 2\n")
    for variable, chosen, origin in [("1", 1, "CLRT_DEVICE"), ("", 2, "config.toml"), ("nonesuch", None, "")]:
        monkeypatch.setenv("CLRT_DEVICE", variable)
        listed = devices()
        assert [row["index"] for row in listed if row["chosen"]] == ([] if chosen is None else [chosen])
        assert [row["index"] for row in listed if "chosen " in row["why"]] == ([] if chosen is None else [chosen])
        assert chosen is None or f"{origin} selects it" in listed[chosen]["why"]
        assert chosen is None or choose()[0].index == chosen


def test_open_device_by_index() -> None:
    opened = open_device(0)
    assert opened.info.chosen and opened.lanes in (1, 8) and opened.layout in ("bvh2", "bvh8")


SKYLAKE = {"avx512f", "avx512dq", "avx512bw", "avx512vl", "avx512cd", "fma", "bmi2", "movbe", "avx2", "bmi1", "f16c"}


@pytest.mark.parametrize(
    ("flags", "name"),
    [
        (set(), "x86-64"),
        ({"sse4_2", "popcnt"}, "nehalem"),
        ({"avx2", "fma", "bmi1", "bmi2", "f16c"}, "x86-64"),
        ({"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe", "sse4_2", "popcnt"}, "haswell"),
        (SKYLAKE, "skylake-avx512"),
        (SKYLAKE - {"avx512bw"}, "haswell"),
        (set().union(*cpu_name.PROCESSORS.values()), "icelake-server"),
    ],
)
def test_best_processor(flags: set[str], name: str) -> None:
    """The newest whose instructions are all there: one that is not crashes the process."""
    assert cpu_name.best_processor(flags) == name


@pytest.mark.parametrize(
    ("name", "flags", "wrong"),
    [
        ("generic", set(), True),
        ("znver3", SKYLAKE, True),
        ("znver3", SKYLAKE - {"avx512f"}, True),
        ("skylake-avx512", SKYLAKE, False),
        ("haswell", SKYLAKE - {"avx512f"}, False),
        ("sandybridge", {"avx"}, False),
    ],
)
def test_names_that_the_library_is_not_made_for(name: str, flags: set[str], wrong: bool) -> None:
    """Zen 4 by Zen 3's name, all later ones, and Zen 3 by its own."""
    assert cpu_name.is_misnamed(name, flags) == wrong


def test_a_named_processor_stays(device: Device) -> None:
    """Once named, or known from the start, nothing is touched again."""
    assert not cpu_name.name_processor(device.cl)
