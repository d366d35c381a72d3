"""What the stations leave open of the answer, in words and as vectors."""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.held import estimate_held
from handeye_cli.geometry.free_directions import NOTHING_DETERMINED, Freedom
from handeye_cli.geometry.observability import nearest_axis
from handeye_cli.records import FloatArray, Noise
from handeye_cli.records.free import FreeDirection, PosePart

_JOINTS = {PosePart.ROTATION: "about", PosePart.TRANSLATION: "along"}


def free_directions(
    chain: Chain, given: Noise | None = None, least: tuple[int, int] = (0, 0)
) -> Freedom:
    """Return the directions of the answer that the stations leave free.

    They are judged against the noise: what is given, or what the residuals show.

    Args:
        chain: One station or more.
        given: Noise levels that are taken as given.
        least: Rotations and translations that are free in any case.
    """
    if len(chain.A) < 2:
        return NOTHING_DETERMINED
    return estimate_held(chain, given, least=least).free


def named(free: Freedom, setup: Setup) -> tuple[FreeDirection, ...]:
    """Return the free directions of the answer with their words, rotations first.

    Args:
        free: The directions.
        setup: Names the frame of the mount.
    """
    parts = [(PosePart.ROTATION, axis) for axis in free.rotations]
    parts += [(PosePart.TRANSLATION, direction) for direction in free.translations]
    return tuple(
        FreeDirection(
            part, vector, setup.mount, f"{part} {_JOINTS[part]} {vector_text(vector, setup.mount)}"
        )
        for part, vector in parts
    )


def explain(free: Freedom, setup: Setup) -> str:
    """Return what is not determined, as the end of a sentence.

    Args:
        free: The directions; at least one.
        setup: Names the answer and the frame of the mount.
    """
    if free.counts == NOTHING_DETERMINED.counts:
        return f"nothing of {setup.answer} is determined"
    if len(free.translations) == 3:
        text = f"the whole translation of {setup.answer}"
    else:
        text = f"the translation of {setup.answer} along "
        text += vector_text(free.translations[0], setup.mount)
    if not len(free.rotations):
        return f"not determined is {text}; its rotation is determined"
    about = "that axis"
    if len(free.translations) == 3:
        about = vector_text(free.rotations[0], setup.mount)
    return f"not determined are {text}, and its rotation about {about}"


def vector_text(vector: FloatArray, frame: str) -> str:
    """Return a unit vector as people read it: by the axis it is near to, and in numbers.

    Args:
        vector: (3,) unit vector.
        frame: The frame it is in.
    """
    numbers = ", ".join(f"{value:.2f}" for value in np.round(vector, 2) + 0.0)
    near = nearest_axis(vector)
    return f"the {frame}'s {near} axis ({numbers})" if near else f"({numbers}) in the {frame} frame"
