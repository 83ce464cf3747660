"""Errors caused by the user's input or machine.

    ClrtError
    ├── UsageError    a wrong option or combination of options        exit code 2
    ├── SceneError    a scene, model or image file, or its content    exit code 3
    │   └── ObjectError  an object of a scene, when it is made        exit code 3
    ├── CheckpointError  a checkpoint that cannot be resumed          exit code 3
    ├── DeviceError   no such device, or the device failed            exit code 4
    │   ├── NoRoomError  the device has not enough memory             exit code 4
    │   └── HungError    the device has stopped responding            exit code 4
    ├── KernelError   the device's compiler rejected the program      exit code 5
    └── OutputError   an image or report could not be written         exit code 6
        ├── KeptBesideError  written next to the file to be replaced  exit code 6
        └── ReaderGoneError  the pipe's reader has ended              exit code 6, or 130 if by Ctrl-C

The public interface raises only these for users' mistakes; any other exception is a bug in clrt.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable


class ClrtError(Exception):
    """Base class of all errors that clrt raises deliberately; `exit_code` is the command line's exit status."""

    exit_code = 1


class UsageError(ClrtError):
    """An option has an invalid value, or options contradict each other."""

    exit_code = 2


class SceneError(ClrtError):
    """A scene cannot be used. `problems` lists everything that is wrong, one sentence each."""

    exit_code = 3

    def __init__(self, problems: str | list[str]) -> None:
        self.problems = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(self.problems))


class ObjectError(SceneError):
    """An object of a scene cannot be made of these values. `faults`: the problems without the object's name before
    them."""

    def __init__(self, name: str, faults: list[str]) -> None:
        self.name, self.faults = name, list(faults)
        super().__init__(self.named(name))

    def named(self, name: str) -> list[str]:
        """Return the problems with another name for the object, such as its place in a file."""
        return [f"{name}{fault}" for fault in self.faults]

    def __reduce__(self) -> tuple[type, tuple[str, list[str]]]:
        return type(self), (self.name, self.faults)


class CheckpointError(ClrtError):
    """A checkpoint is damaged, or belongs to a different render."""

    exit_code = 3


class DeviceError(ClrtError):
    """A device cannot be found, selected or used."""

    exit_code = 4


class NoRoomError(DeviceError):
    """A device does not have enough memory."""


class HungError(DeviceError):
    """A device has stopped responding; waiting for it would never end."""


class KernelError(ClrtError):
    """A kernel does not compile on the selected device; the message contains the build log."""

    exit_code = 5


class OutputError(ClrtError):
    """A result cannot be written."""

    exit_code = 6


class KeptBesideError(OutputError):
    """A result cannot replace a file, and was saved next to it under another name."""


class ReaderGoneError(OutputError):
    """A result cannot be written to a pipe, as its reader has ended."""


def check_choice(name: str, value: object, known: Iterable[object]) -> None:
    """Raise UsageError unless the value is one of `known`; None, which selects a default, is not listed."""
    values = tuple(known)
    if not isinstance(value, str | int | None) or value not in values:
        named = ", ".join(str(each) for each in values if each is not None)
        raise UsageError(f"{name} {value!r} is unknown; choose from {named}{did_you_mean(value, values)}")


def did_you_mean(name: object, known: Iterable[object], shown: Callable[[str], object] = str) -> str:
    """Return the question that ends a message about an unknown name, or nothing if no known one is like it.

    shown: how the name that is meant is to be written.
    """
    from difflib import get_close_matches  # only errors need it

    near = get_close_matches(str(name), [each for each in known if isinstance(each, str)], 1)
    return f"; did you mean {shown(*near)}?" if near else ""
