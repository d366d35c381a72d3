"""The calibration targets: what each looks like, and where its points are in an image.

A target is a file with a board class and a row in the table below; the class is imported when the
first target of its type is used.
"""

from __future__ import annotations

from importlib import import_module

from handeye_cli.errors import InputError, UsageError, did_you_mean
from handeye_cli.records import TargetSpec
from handeye_cli.targets import keys, shorthands
from handeye_cli.targets.board import Board, Detection

__all__ = ["TYPES", "Board", "Detection", "board_class", "build", "parse", "shorthand"]

_BOARDS = {
    "disc-grid": "disc_grid:DiscGrid",
    "asymmetric-circles": "asymmetric_circles:AsymmetricCircles",
    "chessboard": "chessboard:Chessboard",
    "charuco": "charuco:Charuco",
    "apriltag": "tag:AprilTag",
    "aruco": "tag:ArucoTag",
    "apriltag-grid": "tag_grid:AprilTagGrid",
    "aruco-grid": "tag_grid:ArucoTagGrid",
}

TYPES = tuple(_BOARDS)
"""The types of targets, as `type` in a document and the first word of `--target` name them."""


def board_class(name: str) -> type[Board]:
    """Return the class of a type of target.

    Raises:
        KeyError: There is no such type.
    """
    module, attribute = _BOARDS[name].split(":")
    board: type[Board] = getattr(import_module(f"{__name__}.{module}"), attribute)
    return board


def build(spec: TargetSpec) -> Board:
    """Return the board that a document or `--target` describes.

    Raises:
        InputError: The type is unknown, or a key is unknown, missing or of a wrong value.
    """
    if spec.type not in _BOARDS:
        expected, hint = _unknown_type(spec.type)
        raise InputError(expected, where="target", hint=hint)
    return keys.read(board_class(spec.type), spec.parameters)


def parse(text: str) -> TargetSpec:
    """Return the target of a `--target` shorthand, such as `disc-grid:6x6:5mm:4mm`.

    Raises:
        UsageError: The shorthand is not written as its type wants it, or describes no target.
    """
    name = text.split(":", maxsplit=1)[0]
    if name not in _BOARDS:
        expected, hint = _unknown_type(name)
        raise UsageError(expected, where="--target", hint=hint)
    board = board_class(name)
    spec = shorthands.parse(board, text)
    try:
        build(spec)
    except InputError as error:
        hint = error.hint or f"such as {board.EXAMPLE}"
        raise UsageError(error.message, where="--target", hint=hint) from error
    return spec


def shorthand(spec: TargetSpec) -> str:
    """Return the `--target` shorthand of a target; the inverse of `parse`.

    Raises:
        InputError: The target is not valid.
    """
    return shorthands.write(build(spec))


def _unknown_type(name: str) -> tuple[str, str]:
    expected = f"expected one of the targets {', '.join(TYPES)}, found {name!r}"
    near = did_you_mean(name, list(TYPES))
    return (
        expected,
        f"did you mean {near!r}?" if near else f"such as {board_class(TYPES[0]).EXAMPLE}",
    )
