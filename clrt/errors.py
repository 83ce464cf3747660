"""What can go wrong because of the user's input or machine.

    ClrtError
    ├── UsageError    a wrong option or combination of options        exit code 2
    ├── SceneError    a scene, model or picture file, or its content  exit code 3
    ├── CheckpointError  a checkpoint to go on from                   exit code 3
    ├── DeviceError   no such device, or the device failed            exit code 4
    │   ├── NoRoomError  not enough memory there                      exit code 4
    │   └── HungError    it does not answer any more                  exit code 4
    ├── KernelError   the device's compiler refused the program       exit code 5
    └── OutputError   a picture or report could not be written        exit code 6
        ├── KeptBesideError  it is beside the file to be replaced     exit code 6
        └── ReaderGoneError  nobody reads the pipe any more           exit code 6, or 130 where that came by Ctrl-C

Everything public raises only these for users' mistakes; any other exception is a defect of clrt.
"""

from __future__ import annotations

from collections.abc import Iterable


class ClrtError(Exception):
    """Base of all errors that clrt raises on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class UsageError(ClrtError):
    """An option has a wrong value, or options contradict each other."""

    exit_code = 2


class SceneError(ClrtError):
    """A scene cannot be used. `problems` lists every mistake found, one sentence each."""

    exit_code = 3

    def __init__(self, problems: str | list[str]) -> None:
        self.problems = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(self.problems))


class CheckpointError(ClrtError):
    """A checkpoint is damaged, or of another render."""

    exit_code = 3


class DeviceError(ClrtError):
    """A device cannot be found, chosen or used."""

    exit_code = 4


class NoRoomError(DeviceError):
    """A device has not enough memory."""


class HungError(DeviceError):
    """A device does not answer: whoever waits for it, waits for ever."""


class KernelError(ClrtError):
    """A kernel does not compile on the chosen device; the message holds the build log."""

    exit_code = 5


class OutputError(ClrtError):
    """A result cannot be written."""

    exit_code = 6


class KeptBesideError(OutputError):
    """A result cannot replace a file, and is beside it under another name."""


class ReaderGoneError(OutputError):
    """A result cannot be written to a pipe, as whoever read it has gone."""


def check_choice(name: str, value: object, known: Iterable[object]) -> None:
    """UsageError unless the value is one of those known; None, which is for a default, goes unnamed."""
    values = tuple(known)
    if not isinstance(value, str | int | None) or value not in values:
        named = ", ".join(str(each) for each in values if each is not None)
        raise UsageError(f"{name} {value!r} is unknown; choose from {named}")
