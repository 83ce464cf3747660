"""Checks that pip finds wheels for clrt and its extras on each platform and Python version; queries the package index.

    pip install uv && python -m tests.resolution

uv evaluates environment markers for the requested platform; pip only for the one it runs on.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from configparser import ConfigParser
from itertools import product
from pathlib import Path

PLATFORMS = {
    "Linux x86-64": "x86_64-manylinux_2_35",
    "Linux ARM64": "aarch64-manylinux_2_35",
    "Windows x86-64": "x86_64-pc-windows-msvc",
    "macOS ARM64": "aarch64-apple-darwin",
}
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
#: Imgui Bundle's wheels are for macOS 14 and later.
MACOS = {"MACOSX_DEPLOYMENT_TARGET": "14.0"}


def requirements() -> dict[str, list[str]]:
    """Return the requirements of clrt alone, under "clrt", and with each extra."""
    setup = ConfigParser()
    setup.read(Path(__file__).parents[1] / "setup.cfg", encoding="utf-8")
    own = setup["options"]["install_requires"].strip().splitlines()
    extras = setup["options.extras_require"].items()
    return {"clrt": own, **{f"clrt[{name}]": own + text.strip().splitlines() for name, text in extras}}


def fault(needed: list[str], platform: str, python: str) -> str:
    """Return why wheels alone cannot satisfy the requirements, or "" if they can."""
    options = ["--only-binary", ":all:", "--no-config", "--python-platform", platform, "--python-version", python]
    done = subprocess.run(
        [sys.executable, "-m", "uv", "pip", "compile", "-", "--quiet", *options],
        input="\n".join(needed),
        capture_output=True,
        text=True,
        env=os.environ | MACOS,
    )
    return done.stderr.strip() or "failed" if done.returncode else ""


def faults_at(platform: str, python: str) -> dict[str, str]:
    """Return the faults of clrt alone and with each extra; first tries all together, which usually succeeds."""
    sets = requirements()
    together = fault(sorted({each for needed in sets.values() for each in needed}), PLATFORMS[platform], python)
    return {name: together and fault(needed, PLATFORMS[platform], python) for name, needed in sets.items()}


def main() -> int:
    """Print a table and the faults below it; return the exit status."""
    places = list(product(PLATFORMS, PYTHONS))
    with ThreadPoolExecutor(8) as pool:
        found = dict(zip(places, pool.map(lambda place: faults_at(*place), places)))
    print(f"{'':16}", *(f"{platform:>20}" for platform in PLATFORMS))
    for name in requirements():
        print(
            f"{name:16}",
            *(
                f"{' '.join('no' if found[platform, python][name] else python for python in PYTHONS):>20}"
                for platform in PLATFORMS
            ),
        )
    wrong = [(name, *place, why) for place, faults in found.items() for name, why in faults.items() if why]
    for name, platform, python, why in wrong:
        print(f"\n{name} on {platform}, Python {python}:\n{why}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
