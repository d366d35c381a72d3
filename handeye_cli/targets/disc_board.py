"""What all targets of discs have in common: their points are measured by fitting the discs."""

from __future__ import annotations

from abc import abstractmethod

from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.disc_refinement import recentred_discs, refine_discs


class DiscBoard(Board):
    """A target whose points are the centres of its discs."""

    @property
    @abstractmethod
    def _discs(self) -> FloatArray:
        """(n, 3) centre (x, y) and radius of each disc, metres."""

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return the images of the discs' true centres, with the noise that the image leaves."""
        return refine_discs(grey, self._discs, seen, camera)

    def recentred(self, seen: Detection, before: Camera | None, after: Camera) -> Detection:
        """Return the centres that the same outlines have with other intrinsics."""
        return recentred_discs(self._discs, seen, before, after)
