"""Why no grid of discs was found, from what the search saw on its way and from the image itself."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from handeye_cli.records import FloatArray, GreyImage
from handeye_cli.targets import image_faults, image_sides

_SMALLEST = 6.0
"""Width in pixels below which discs are lost."""
_NEEDED = f"at least {_SMALLEST:.0f} px are needed"
_EDGE = 1.0
"""Pixels from the image's edge within which a disc counts as cut."""
_FEW = 0.1
"""Share of the discs that may be missing although the plate is the declared one."""
_CHANCE = 0.2
"""Share of the grid below which a lattice among other spots may be one by chance."""
_AMONG = (0.85, 0.6)
"""Share of the spots that lie on the lattice if it is the plate: of those seen together with it,
and of those ever seen, up to the number of discs."""
_HALF = 0.5
"""Share of the discs that must be seen to take what else is there for theirs."""


@dataclass
class Attempts:
    """The best that was seen of a grid so far.

    Attributes:
        expected: Number of discs of the grid.
        name: Of the grid, such as `6x6`.
        spots: Largest number of spots like discs.
        width: Their median width, pixels.
        covered: Largest number of spots that lie where discs of the grid should be.
        among: Number of all spots that were seen together with those.
        sides: Sides of the image that cut this grid.
        absent: Discs of this grid that are missing inside the image.
        larger: Whether the grid fits several places of a larger one.
        between: Largest number of discs that lie between those of a grid.
    """

    expected: int
    name: str
    spots: int = 0
    width: float = 0.0
    covered: int = 0
    among: int = 0
    sides: list[str] = field(default_factory=list)
    absent: int = 0
    larger: bool = False
    between: int = 0
    _last: int = field(default=0, init=False, repr=False)

    def saw(self, widths: FloatArray) -> None:
        """Note the widths of spots like discs, among which a lattice is sought next."""
        self._last = len(widths)
        if len(widths) > self.spots:
            self.spots, self.width = len(widths), float(np.median(widths))

    def fitted(self, covered: int, boxes: list[FloatArray], size: tuple[int, ...]) -> None:
        """Note how well the grid can be laid over a lattice of spots.

        Args:
            covered: Spots that are at places of the grid.
            boxes: (n, 2, 2) least and largest x and y of the grid's discs, pixels, for each way in
                which it covers so many.
            size: Height and width of the image.
        """
        self.larger |= covered == self.expected and len(boxes) > 1
        if covered <= self.covered:
            return
        # of all ways the one with the most discs outside, which leaves the fewest absent
        outside, self.sides = max(
            (image_sides.leaving(each, size, _EDGE) for each in boxes),
            key=lambda each: each.outside,
        )
        self.covered, self.among = covered, self._last
        self.absent = self.expected - covered - outside

    def refuted(self, between: int, beyond: int) -> None:
        """Note discs between those of a grid that was found, and where its next row would be."""
        self.between = max(self.between, between)
        self.larger |= beyond > 0

    @property
    def refused(self) -> bool:
        """Whether the plate that was seen is another one."""
        return self.larger or self.between > 0

    def reason(self, grey: GreyImage) -> str:
        """Return the most telling reason for an image without the grid."""
        if self.between:
            found = f"{self.between} more discs as large lie between those of {self.name}"
            return f"{found}: the plate is another one"
        if self.larger:
            return f"the discs go on beyond {self.name}: the declared grid fits several places"
        known = self._known()
        cut = self._cut()
        # a few spots by chance on a lattice say less than the state of the image
        discs = self.spots >= _HALF * self.expected
        cause = None if known and cut else image_faults.fault(grey, all_around=discs)
        if cut and cause is None:
            found = f"{self.covered} of {self.expected} discs"
            return f"{found}: the plate leaves the image {image_sides.named(self.sides)}"
        cause = cause or self._narrow()
        if not known and (self.spots >= self.expected or self._lattice()):
            found = f"{self.spots} spots like discs were found, but no grid of {self.name} among"
            cause = cause or self._another()
            return f"{found} them: {cause}" if cause else f"{found} them"
        count = self.covered if known else max(self.covered, self.spots)
        found = f"{count} of {self.expected} discs were found"
        cause = cause or (self._incomplete() if known else self._tiny(grey))
        return f"{found}: {cause}" if cause else found

    def _cut(self) -> bool:
        least = max(4, min(_CHANCE * self.expected, 0.5 * self.among))
        few_absent = self.absent <= _FEW * self.expected
        return bool(self.sides) and self.covered >= least and few_absent

    def _known(self) -> bool:
        """Say whether what lies on a lattice is the plate, as far as it is seen."""
        together, ever = _AMONG
        least = max(together * self.among, ever * min(self.spots, self.expected))
        enough = self.among < self.expected or self.covered == self.expected
        return enough and self._lattice() and self.covered >= least

    def _lattice(self) -> bool:
        """Say whether more spots lie on a lattice than would by chance."""
        return self.covered >= max(4, _CHANCE * self.expected)

    def _narrow(self) -> str | None:
        discs = _HALF <= self.spots / self.expected <= 2.0 or self._known()
        if not discs or self.width >= _SMALLEST:
            return None
        return f"they are {self.width:.1f} px wide, {_NEEDED}"

    def _another(self) -> str | None:
        if not self._lattice():
            return None
        most = f"at most {self.covered} lie on one"
        if self.absent <= _FEW * self.expected:
            return most
        return f"{most}; are the numbers, diameter and spacing of its discs as declared?"

    def _incomplete(self) -> str | None:
        if self.covered == self.expected:
            return "their edges are not those of discs as large as declared, on a flat plate"
        # one disc alone cannot be due to a wrong number of rows or columns
        if self.absent > 1:
            missing = f"{self.absent} are missing inside the image"
            return f"{missing}, they are covered or the plate is none of {self.name}"
        return None

    def _tiny(self, grey: GreyImage) -> str | None:
        count, apart = max(map(image_faults.even_specks, (grey, 255 - grey)))
        if count < _HALF * self.expected:
            return None
        return f"some {count} spots lie {apart:.1f} px apart, too small for discs, {_NEEDED}"
