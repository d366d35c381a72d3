"""Everything a page shows of a case, computed before anything is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye_cli.gates import Limits
from handeye_cli.geometry import rotations
from handeye_cli.pipeline import Steps
from handeye_cli.records import Verification, VerificationRow
from handeye_cli.reporting.axis_coverage import AxisCoverage, axis_coverage
from handeye_cli.reporting.batch_light import RowLight, row_lights
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.light import Light, judge, nearest_row
from handeye_cli.reporting.pictures import Album, album_of
from handeye_cli.reporting.pixel_residuals import PixelResiduals, pixel_residuals
from handeye_cli.reporting.scene import Scene, scene_of, scene_of_plan


@dataclass(frozen=True)
class Contents:
    """A case and what its figures show.

    Attributes:
        case: The documents.
        light: The verdict, or None where there is nothing to judge.
        seen: The verification that is nearest to the answer, and its row, if there is one.
        scene: Where everything stood.
        plans: The same of each plan.
        residuals: Of the points in the images.
        axes: Of the rotations between stations.
        album: The images.
        no_album: Why there are no images, where there should be some.
        batches: The lights of the recordings of each batch, the worst on top.
    """

    case: Case
    light: Light | None
    seen: tuple[Verification, VerificationRow] | None
    scene: Scene | None = None
    plans: tuple[Scene, ...] = ()
    residuals: PixelResiduals | None = None
    axes: AxisCoverage | None = None
    album: Album | None = None
    no_album: str | None = None
    batches: tuple[tuple[RowLight, ...], ...] = ()


@dataclass(frozen=True)
class Distance:
    """How far an answer is from the first one on the page: radians and metres."""

    rotation: float
    translation: float


def contents_of(
    case: Case, limits: Limits, steps: Steps, *, images: bool = True, unreached: str | None = None
) -> Contents:
    """Compute what a page shows of a case.

    Args:
        case: With all that can be known of it.
        limits: What its errors must keep.
        steps: How its images are looked at.
        images: Whether they are wanted.
        unreached: Why the recording with the images was not found, where it was not.
    """
    target = None if case.stations is None else case.stations.target
    album = album_of(case, steps) if images else None
    return Contents(
        case=case,
        light=judge(case, limits),
        seen=nearest_row(case),
        scene=scene_of(case),
        plans=tuple(scene_of_plan(plan, target) for plan in case.plans),
        residuals=None if case.stations is None else pixel_residuals(case.stations),
        axes=axis_coverage(case),
        album=album,
        no_album=unreached if images and album is None and _had_images(case) else None,
        batches=tuple(row_lights(batch, limits) for batch in case.batches),
    )


def _had_images(case: Case) -> bool:
    seen_by = [each.camera for each in (case.stations, case.calibration) if each is not None]
    return case.features is not None or any(camera is not None for camera in seen_by)


def distances(cases: Sequence[Case]) -> tuple[Distance | None, ...]:
    """Return how far every answer is from the first; None for the first, and without an answer."""
    answers = [each.calibration for each in cases]
    first = next((each for each in answers if each is not None), None)
    found: list[Distance | None] = []
    for answer in answers:
        if first is None or answer is None or answer is first or answer.setup is not first.setup:
            found.append(None)
            continue
        X, Y = first.mount_T_camera.matrix, answer.mount_T_camera.matrix
        angle = float(rotations.angle(X[:3, :3].T @ Y[:3, :3]))
        found.append(Distance(angle, float(np.linalg.norm(X[:3, 3] - Y[:3, 3]))))
    return tuple(found)
