"""What every target can do: say where its points are, and find them in an image."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import ClassVar, Self

import numpy as np

from handeye_cli.records import Camera, Finding, FloatArray, GreyImage, IntArray, TargetSpec
from handeye_cli.targets.drawing import Drawing


@dataclass(frozen=True)
class Detection:
    """The points of a target that were found in one image.

    Attributes:
        ids: (n,) indices of the target's points.
        pixels: (n, 2) their images, in pixels.
        sigma_px: Standard deviation of one coordinate, or None when the detector cannot tell.
        reason: Why the target was not found, for people; None when it was.
        note: Which look of the target this is, for people, when its description leaves that open.
    """

    ids: IntArray
    pixels: FloatArray
    sigma_px: float | None = None
    reason: str | None = None
    note: str | None = None

    @classmethod
    def missing(cls, reason: str) -> Self:
        """Return the detection of an image in which the target was not found."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros((0, 2)), reason=reason)

    @classmethod
    def whole(cls, pixels: FloatArray) -> Self:
        """Return the detection of all points, in their order, from (n, 2) pixels."""
        return cls(np.arange(len(pixels), dtype=np.int64), np.asarray(pixels, dtype=np.float64))


@dataclass(frozen=True)
class Board(ABC):
    """A calibration target; the fields of a subclass are its keys in a document.

    The target's frame has x to the right and y down as seen from its front, z into it, and its
    points at z = 0.

    Attributes:
        TYPE: The name of the type.
        SHORTHAND: How `--target` writes it: keys in braces, what may be left out in brackets.
        EXAMPLE: A shorthand for messages.
    """

    TYPE: ClassVar[str]
    SHORTHAND: ClassVar[str]
    EXAMPLE: ClassVar[str]

    @property
    def spec(self) -> TargetSpec:
        """What a document says of this board; keys that were not given are left out."""
        given = {each.name: getattr(self, each.name) for each in fields(self)}
        present = {name: value for name, value in given.items() if value is not None}
        return TargetSpec(self.TYPE, present)

    @abstractmethod
    def points(self) -> FloatArray:
        """Return the (n, 3) points in the target's frame, metres; ids are indices into them."""

    @abstractmethod
    def drawing(self) -> Drawing:
        """Return what the target looks like from its front."""

    @abstractmethod
    def detect(self, grey: GreyImage) -> Detection:
        """Return the points found in a (height, width) image."""

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return what was detected, measured again through the camera model where that gains.

        Args:
            grey: (height, width) image.
            seen: What `detect` found in it.
            camera: Intrinsics, or None when they are unknown.
        """
        return seen

    def recentred(self, seen: Detection, before: Camera | None, after: Camera) -> Detection:
        """Return what was refined with one camera as if it had been with another.

        Where a point is within the outline that an image shows of it may depend on the camera.

        Args:
            seen: What `refine` gave.
            before: The intrinsics it was given, None for none.
            after: Other intrinsics.
        """
        return seen

    def settled(self, seen: Sequence[Detection]) -> tuple[Board, Finding | None]:
        """Return the target as a whole recording shows it, where its description leaves that open.

        Args:
            seen: What was found in the images.

        Returns:
            The target, and what the user should know of the choice.
        """
        return self, None

    def turns(self) -> tuple[IntArray, ...]:
        """Return the permutations of the points that a detector cannot tell apart.

        Returns:
            (n,) arrays p, the identity first: what was detected as point k may be point p[k].
        """
        return (np.arange(len(self.points()), dtype=np.int64),)
