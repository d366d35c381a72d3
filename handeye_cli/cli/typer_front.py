"""The command line as Typer reads it: help, faults, and every spelling it knows."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any

import typer

from handeye_cli import __version__
from handeye_cli.cli.flags import DEBUG, Argument, Flag
from handeye_cli.cli.grouping import command_of, flags_of, groups_of

_EPILOG = (
    "The line is recording -> extract -> extrinsics -> solve -> verify; every command takes "
    "the recording or any document on the way and runs what is missing. Exit codes: 0 done, 1 a "
    "bug, 2 wrong usage, 3 bad input, 4 the data do not determine the answer, 5 not converged, "
    "6 a quality limit was missed."
)


def application(modules: Mapping[str, Any]) -> typer.Typer:
    """Return the application.

    Args:
        modules: The modules of its commands by their names, in the order of the help. Each has a
            function of that name, which takes groups of flags, and its EXAMPLES.
    """
    app = typer.Typer(
        name="handeye",
        epilog=_EPILOG,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    app.callback()(_handeye)
    for name, module in modules.items():
        command = command_of(module, name)
        app.command(name, help=_help(command, module.EXAMPLES))(_flat(command))
    return app


def _help(command: Callable[..., None], examples: tuple[str, ...]) -> str:
    paragraphs = inspect.cleandoc(command.__doc__ or "").split("\n\n")
    lines = ["Examples:", *(f"  $ {example}" for example in examples)]
    # A \b keeps the lines of the paragraph that follows it as they are.
    text = [*(paragraph.replace("\n", " ") for paragraph in paragraphs), "\n".join(["\b", *lines])]
    return "\n\n".join(text)


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


def _flat(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command with the fields of its groups as keyword parameters, as Typer wants them."""
    groups = groups_of(command)

    @functools.wraps(command)
    def flattened(**values: Any) -> None:
        command(
            **{
                name: group(**{field.name: values[field.name] for field in fields(group)})
                for name, group in groups.items()
            }
        )

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
