"""Groups of commands."""

from __future__ import annotations

import click


class CommandGroup(click.Group):
    """Group of commands that suggests the closest name for a misspelled one."""

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if arguments and not arguments[0].startswith("-") and self.get_command(context, arguments[0]) is None:
            from ..scene.fields.field_types import unknown  # valid commands do not need it

            context.fail(f'command "{arguments[0]}" {unknown(arguments[0], self.list_commands(context))}')
        return super().resolve_command(context, arguments)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Each with the whole first sentence of its help, which click cuts to a line."""
        commands = ((name, self.get_command(context, name)) for name in self.list_commands(context))
        rows = [(name, command.get_short_help_str(limit=10_000)) for name, command in commands if command is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)
