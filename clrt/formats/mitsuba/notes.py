"""How the scene that is read differs from Mitsuba's."""

from __future__ import annotations

from .xml import Plugin


class Notes:
    """Differences of models. approximate: whether a stand-in is used where clrt lacks a model."""

    def __init__(self, approximate: bool) -> None:
        self.approximate = approximate
        self._found: dict[str, dict[str, None]] = {}

    @property
    def differences(self) -> list[str]:
        """One sentence per difference, which names the first plugin and counts the others."""
        return [
            f"{next(iter(places))}{f', and {len(places) - 1} more' if len(places) > 1 else ''}: {what}"
            for what, places in self._found.items()
        ]

    def differ(self, plugin: Plugin, what: str) -> None:
        """Note how a model of clrt differs from the plugin's."""
        self._found.setdefault(what, {})[plugin.at] = None

    def instead(self, plugin: Plugin, what: str, remedy: str, stand_in: str, feature: str = "") -> None:
        """Note that a stand-in replaces what clrt lacks. Raises UnsupportedError unless `approximate`."""
        if not self.approximate:
            plugin.refuse(what, f"{remedy}, or with --approximate {stand_in}", feature)
        self.differ(plugin, f"{what}; {stand_in}")
