"""The default device: that of $CLRT_DEVICE, else of the user's configuration file.

    device = "gpu"      # what --device takes

That file is $CLRT_CONFIG, else config.toml in the folder `clrt` of the user's configuration (~/.config on Linux).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from ...errors import UsageError


class Preference(NamedTuple):
    """The user's default device. selector: see `discover.select`; origin: where it was set, for messages."""

    selector: str | int
    origin: str


def preferred_device() -> Preference | None:
    """Return the user's default device, or None. Raises UsageError if the file is unreadable or has other contents."""
    if named := os.environ.get("CLRT_DEVICE"):
        return Preference(named, "CLRT_DEVICE")
    path = config_file()
    try:
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError, RuntimeError):
        if os.environ.get("CLRT_CONFIG"):
            raise UsageError(
                f"{path}: CLRT_CONFIG names this file, which does not exist; create it or unset CLRT_CONFIG"
            ) from None
        return None
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror}); make it readable, or move it away") from error
    device = _settings(path, content).get("device")
    if device is None or device == "":
        return None
    if not isinstance(device, str | int) or isinstance(device, bool):
        raise UsageError(f'{path}: device is {device!r}; write a number, a name in quotes, an id, "cpu" or "gpu"')
    return Preference(device, str(path))


def config_file() -> Path:
    """Return the path of the user's configuration file, which need not exist."""
    if named := os.environ.get("CLRT_CONFIG"):
        return Path(named)
    from platformdirs import user_config_dir

    return Path(user_config_dir("clrt")) / "config.toml"


def _settings(path: Path, content: bytes) -> dict[str, object]:
    import tomllib

    try:
        settings = tomllib.loads(content.decode())
    except ValueError as error:
        raise UsageError(f'{path}: is not valid TOML ({error}); write device = "gpu", or move it away') from error
    if others := sorted(set(settings) - {"device"}):
        raise UsageError(f"{path}: {', '.join(others)} is unknown; the only key is device")
    return settings
