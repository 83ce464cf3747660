"""`clrt devices`: the OpenCL devices of this machine, best first, with correctness checks and speed measurements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from ..errors import DeviceError
from .logs import verbose_option
from .option_types import Finite

if TYPE_CHECKING:
    from ..bench.tuning.tune import Trial
    from ..device.device_info import DeviceInfo, Tuning, Verdict


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list.")
@click.option("--check", is_flag=True, help="Check each device against known results, and store the outcome.")
@click.option(
    "--bench",
    is_flag=True,
    help="Measure each device's rays per second, rank by it, and find how it renders fastest.",
)
@click.option("--device", "selectors", multiple=True, metavar="SEL", help="Only this device; may be repeated.")
@click.option(
    "--limit",
    type=Finite(1.0),
    default=300.0,
    show_default=True,
    metavar="SECONDS",
    help="Time limit of a device's check or measurement.",
)
@verbose_option
def command(as_json: bool, check: bool, bench: bool, selectors: tuple[str, ...], limit: float) -> None:
    """List the OpenCL devices, best first; * marks the default.

    A check or measurement takes seconds per device, a measurement of a simulator minutes: simulators are included only
    if selected with --device. A device that fails its check is used only if selected explicitly, until its driver or
    clrt changes or it passes.
    """
    from ..device.discovery.discover import as_dict, find_devices, select
    from ..device.discovery.install_advice import no_device
    from ..device.discovery.user_preference import preferred_device
    from ..output.json_text import json_text

    preference = preferred_device()
    before = [info for info, _ in find_devices(again=True)]
    wanted = [select(selector)[0].id for selector in selectors]
    tried = [info for info in before if (info.id in wanted if wanted else info.usable and info.type != "simulator")]
    verdicts: dict[str, Verdict] = {}
    problems = [problem for info in tried if check and (problem := _checked(info, limit, verdicts))]
    problems += [problem for info in tried if bench and (problem := _measured(info, limit))]
    found = [
        replace(info, check=verdicts.get(info.id, info.check))
        for info, _ in find_devices(preference=preference)
        if not wanted or info.id in wanted
    ]
    if as_json:
        click.echo(json_text([as_dict(info) for info in found], indent=1))
    else:
        click.echo("\n".join(line for info in found for line in _lines(info)), nl=bool(found))
    if not found:
        click.echo(no_device(), err=True)
    if preference:
        click.echo(
            f"{preference.origin} selects {preference.selector!r}: device {select()[0].index} is the default", err=True
        )
    problems += [
        f"{info.name} failed the check: update the driver and run `clrt devices --check` again; until that "
        "passes, it is used only if selected explicitly"
        for info in found
        if info.id in verdicts and info.failed
    ]
    if problems:
        raise DeviceError("; ".join(problems))


def _measured(info: DeviceInfo, limit: float) -> str:
    """Measure a device's speed and how it renders fastest, and store both; return an error message, or ""."""
    from ..bench.rays.device_speed import measure_device
    from ..bench.tuning.tune import tune
    from ..device.discovery.measured_speeds import keep_speed
    from ..device.discovery.tunings import keep_tuning
    from ..device.open import open_device

    click.echo(f"{info.name}: measuring", err=True)
    try:
        speed = measure_device(info, limit)
        trial = tune(open_device(info.id), limit, lambda failure: click.echo(failure, err=True))
    except DeviceError as error:
        return str(error)
    click.echo("\n".join(_trial_lines(trial)), err=True)
    stored = keep_speed(info, speed) and keep_tuning(info, trial.best)
    return "" if stored else f"{info.name}: its speed cannot be stored: the cache folder is not writable"


def _trial_lines(trial: Trial) -> Iterator[str]:
    """Return a line per candidate of a trial: its samples per second by scene; * marks the best."""
    for tuning, seconds in trial.seconds.items():
        rates = ", ".join(f"{name} {1e-6 / took:.3g}" for name, took in seconds.items())
        yield f"{'*' if tuning == trial.best else ' '} {_told(tuning)}: {rates} Msamples/s"


def _told(tuning: Tuning) -> str:
    return f"paths {tuning.paths}, layout {tuning.layout}, work-groups of {tuning.group_size}"


def _checked(info: DeviceInfo, limit: float, verdicts: dict[str, Verdict]) -> str:
    """Check a device, report progress, and store the verdict, also in `verdicts`; return an error message, or ""."""
    from ..check.run_check import check_device
    from ..device.discovery.check_results import keep_verdict

    try:
        verdict = check_device(info, limit, lambda part: click.echo(f"{info.name}: {part}", err=True))
    except DeviceError as error:
        return str(error)
    if not keep_verdict(info, verdict):
        click.echo(f"{info.name}: the result cannot be stored: the cache folder is not writable", err=True)
    verdicts[info.id] = verdict
    return ""


def _lines(info: DeviceInfo) -> Iterator[str]:
    yield f"{'*' if info.chosen else ' '} {info.index}  {info.id}  {info.type:11}  {info.name}"
    if info.type != "none":
        yield (
            f"     {info.platform}, {info.platform_version}, driver {info.driver}; "
            f"{info.compute_units} compute units, {info.global_bytes / 2**30:.1f} GiB"
        )
    yield from (f"     {place}" for place in info.hardware)
    yield f"     {'usable' if info.usable else 'not usable'}: {info.why}"
    yield from (f"     known fault of this driver: {fault}" for fault in info.known_faults)
    if info.bench:
        yield (
            f"     Mrays/s: {info.bench.mrays_primary:.3g} primary, {info.bench.mrays_bounce:.3g} bounce, "
            f"{info.bench.mrays_shadow:.3g} shadow"
        )
    if info.tuning:
        yield f"     renders by {_told(info.tuning)}"
    if not info.usable:
        return
    if info.check is None:
        named = f" --device {info.index}" if info.type == "simulator" else ""
        yield f"     not checked: `clrt devices --check{named}`"
        return
    yield f"     checked {info.check.when} in {info.check.seconds} s: {'passed' if info.check.passed else 'FAILED'}"
    yield from (f"       {failure}" for failure in info.check.failures)
    if info.check.figures:
        yield f"       {'; '.join(f'{name}: {figure}' for name, figure in info.check.figures.items())}"
