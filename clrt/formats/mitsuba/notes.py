"""How the scene that is read differs from Mitsuba's."""

from __future__ import annotations

from .xml import Plugin


class Notes:
    """Differences, one sentence each. approximate: whether a stand-in is used where clrt lacks a model."""

    def __init__(self, approximate: bool) -> None:
        self.approximate = approximate
        self.differences: list[str] = []

    def differ(self, plugin: Plugin, what: str) -> None:
        """Note how a model of clrt differs from the plugin's."""
        self._add(f"{plugin.at}: {what}")

    def instead(self, plugin: Plugin, what: str, remedy: str, stand_in: str, feature: str = "") -> None:
        """Note that a stand-in replaces what clrt lacks. Raises UnsupportedError unless `approximate`."""
        if not self.approximate:
            plugin.refuse(what, f"{remedy}, or with --approximate {stand_in}", feature)
        self._add(f"{plugin.at}: {what}; {stand_in}")

    def _add(self, difference: str) -> None:
        if difference not in self.differences:
            self.differences.append(difference)
