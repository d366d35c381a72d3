"""The pose of one frame in another that never moves against it, out of a recording's TF."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from handeye_cli.errors import InputError
from handeye_cli.recording import survey
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.several_files import Paths
from handeye_cli.recording.transforms import Chain, Samples, TransformTree
from handeye_cli.records import FloatArray

_ANY_TIME = np.zeros(1, dtype=np.int64)
"""A static transform holds at all times."""


def read(path: Paths, parent: str, child: str, flags: tuple[str, str]) -> FloatArray:
    """Return the (4, 4) `parent_T_child` of two frames of a recording.

    Args:
        path: An MCAP file, the folder of a recording in several files, or these files.
        parent: Name of the frame the pose is in.
        child: Name of the frame it is of.
        flags: The flags that named the two, for error messages.

    Raises:
        InputError: The recording cannot be read, has no such frames, does not join them, or has
            one of the links between them move.
    """
    tree = TransformTree(survey.take(path).links)
    start, end = (
        tree.require(name, flag) for name, flag in zip((parent, child), flags, strict=True)
    )
    try:
        chain = tree.chain(start, end, named=True)
    except InputError as error:
        # the tree speaks of the flags that choose a robot's frames
        error.hint = f"choose frames that one tree joins with {' and '.join(flags)}"
        raise
    _require_fixed(chain)
    poses, _ = replace(chain, to_base=_held(chain.to_base), to_gripper=_held(chain.to_gripper)).at(
        _ANY_TIME, Clock.LOG
    )
    return np.asarray(poses[0])


def _require_fixed(chain: Chain) -> None:
    moving = [f"{link.child!r} in {link.parent!r}" for link in chain.dynamic if link.moves]
    if moving:
        raise InputError(
            f"expected {chain.gripper!r} fixed in {chain.base!r}, found that {moving[0]} moves",
            hint="a camera's optical frame and its mount link are parts of one body",
        )


def _held(links: Iterable[Samples]) -> tuple[Samples, ...]:
    """Return links that stand still as static ones, as drivers publish some of theirs on /tf."""
    return tuple(replace(link, static=True) for link in links)
