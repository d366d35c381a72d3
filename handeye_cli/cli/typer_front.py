"""The command line as Typer reads it: faults, completion, and every spelling it knows."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from handeye_cli import __version__
from handeye_cli.cli import help as texts
from handeye_cli.cli.flags import DEBUG, Argument, Flag
from handeye_cli.cli.grouping import command_of, flags_of, groups_of
from handeye_cli.cli.refusals import refuse_repeated, usage_error
from handeye_cli.cli.values import check_values

# Click's root of what a line is refused for; Typer has a Click of its own from some version on.
_Refusal = cast(type[Exception], typer.BadParameter.__mro__[2])


def carry_out(modules: Mapping[str, Any], name: str, words: Sequence[str]) -> int:
    """Carry out a command line and return its exit code.

    Args:
        modules: See `application`.
        name: The command; empty where a line has none.
        words: What follows it.

    Raises:
        UsageError: The line is not one of this command.
    """
    if name:
        refuse_repeated(command_of(modules[name], name), words)
    try:
        code = get_command(application(modules))(
            [name, *words] if name else [*words], prog_name="handeye", standalone_mode=False
        )
    except typer.Abort:
        raise KeyboardInterrupt from None
    except _Refusal as refused:
        command = command_of(modules[name], name) if name else None
        raise usage_error(refused, name, command, words) from refused
    return code or 0


class _Commands(TyperGroup):
    """Commands of one word or two, for the completion of shells, which hand over word by word."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        together = " ".join(args[:2])
        if together in self.commands:
            return together, self.commands[together], args[2:]
        return super().resolve_command(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        formatter.write(texts.of_all())

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        found = super().shell_complete(ctx, incomplete)
        return [each for each in found if " " not in each.value]


def application(modules: Mapping[str, Any]) -> typer.Typer:
    """Return the application.

    Args:
        modules: The modules of its commands by their names, in the order of the help. Each has a
            function of that name, which takes groups of flags, and its EXAMPLES.
    """
    app = typer.Typer(
        name="handeye",
        cls=_Commands,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    app.callback()(_handeye)
    for name, module in modules.items():
        command = command_of(module, name)
        app.command(name, cls=_with_help(name, module))(_flat(command, name))
    return app


def _with_help(name: str, module: Any) -> type[TyperCommand]:
    """Return the class of a command whose help is the one that is shown without Typer too."""

    class Command(TyperCommand):
        def format_help(self, ctx: Any, formatter: Any) -> None:
            formatter.write(texts.of_command(name, module))

    return Command


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"handeye {__version__}")
        raise typer.Exit


def _handeye(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
    debug: Annotated[
        bool, typer.Option(DEBUG, help="Show the traceback of a bug; it may stand anywhere.")
    ] = False,
) -> None:
    """Find where a camera sits on a robot, from a recording, and say how sure that is."""


def _flat(command: Callable[..., None], name: str) -> Callable[..., None]:
    """Return a command with the fields of its groups as keyword parameters, as Typer wants them."""
    groups = groups_of(command)

    @functools.wraps(command)
    def flattened(**values: Any) -> None:
        filled = {
            each: group(**{field.name: values[field.name] for field in fields(group)})
            for each, group in groups.items()
        }
        check_values(filled, name)
        command(**filled)

    parameters = [parameter for group in groups.values() for parameter in _parameters(group)]
    flattened.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    flattened.__annotations__ = {each.name: each.annotation for each in parameters}
    return flattened


def _parameters(group: Any) -> list[inspect.Parameter]:
    flags = flags_of(group)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=Annotated[flags[field.name][0], _for_typer(flags[field.name][1])],
        )
        for field in fields(group)
    ]


def _for_typer(flag: Flag) -> Any:
    kind = typer.Argument if isinstance(flag, Argument) else typer.Option
    return kind(*flag.names, **flag.settings)
