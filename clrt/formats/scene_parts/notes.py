"""How the scene that is read differs from the other renderer's, and what is unsupported."""

from __future__ import annotations

from typing import NoReturn, Protocol

from ...errors import SceneError


class UnsupportedError(SceneError):
    """A scene uses unsupported features. `features`: their names, two or three words each."""

    def __init__(self, problems: str | list[str], features: list[str]) -> None:
        super().__init__(problems)
        self.features = features


class Statement(Protocol):
    """Part of a scene file that a message names: a plugin of Mitsuba, a directive of pbrt."""

    @property
    def at(self) -> str:
        """Its place and name in messages."""

    def refuse(self, what: str, remedy: str, feature: str = "") -> NoReturn:
        """Raise UnsupportedError: "line N: WHERE: what; remedy"."""


class Notes:
    """Differences of models. approximate: whether a stand-in is used where clrt lacks a model."""

    def __init__(self, approximate: bool) -> None:
        self.approximate = approximate
        self._found: dict[str, dict[str, None]] = {}

    @property
    def differences(self) -> list[str]:
        """One sentence per difference, which names the first statement and counts the others."""
        return [
            f"{next(iter(places))}{f', and {len(places) - 1} more' if len(places) > 1 else ''}: {what}"
            for what, places in self._found.items()
        ]

    def differ(self, statement: Statement, what: str) -> None:
        """Note how a model of clrt differs from the statement's."""
        self._found.setdefault(what, {})[statement.at] = None

    def instead(self, statement: Statement, what: str, remedy: str, stand_in: str, feature: str = "") -> None:
        """Note that a stand-in replaces what clrt lacks. Raises UnsupportedError unless `approximate`."""
        if not self.approximate:
            statement.refuse(what, f"{remedy}, or with --approximate {stand_in}", feature)
        self.differ(statement, f"{what}; {stand_in}")
