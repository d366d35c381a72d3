"""Saddles that lie on the lattice of a chessboard, whatever the perspective and the lens.

The edges of a corner lead to its neighbours, where dark and light are exchanged. So the lattice
grows along the edges; a camera model is not needed, only that the lattice changes slowly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.lattice_walk import joined_parts
from handeye_cli.targets.saddles import Saddles

_STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
_AROUND = 20
"""Nearest saddles among which the four neighbours are, even at a tilt of 60 degrees."""
_OFF = np.sin(np.radians(22.0))
"""Sine of the angle by which the way to a neighbour may be off an edge."""
_ALIKE = 3.0
"""Largest ratio of the contrasts of neighbours."""
_ASTRAY = 0.25
"""Pitches by which a corner may be off the place that its neighbours give it."""
_MOST = 4
"""Parts of a lattice that are looked at."""


@dataclass(frozen=True)
class Part:
    """A part of a chessboard's lattice.

    Attributes:
        places: (m, 2) whole-numbered places x, y; the axes turn as those of the image do.
        pixels: (m, 2) where they are in the image.
    """

    places: IntArray
    pixels: FloatArray

    def located(self, wanted: IntArray) -> FloatArray:
        """Return the (n, 2) pixels of (n, 2) places, those not in this part by their neighbours.

        A place that is in line with nothing known has NaN.
        """
        both = np.concatenate([self.places, wanted])
        low = both.min(axis=0)
        sheet = np.full((*(np.ptp(both, axis=0) + 1), 2), np.nan)
        sheet[tuple((self.places - low).T)] = self.pixels
        at = tuple((wanted - low).T)
        while np.any(np.isnan(sheet[at])):
            filled = np.where(np.isnan(sheet), _mean_said(sheet), sheet)
            if np.all(np.isnan(filled) == np.isnan(sheet)):
                break
            sheet = filled
        return np.asarray(sheet[at])


def lattice_parts(saddles: Saddles) -> Iterator[Part]:
    """Yield the largest parts of chessboards among saddles."""
    if len(saddles) < 4:
        return
    for members, places in joined_parts(_squares(_neighbours(saddles)))[:_MOST]:
        part = _settled(Part(places, saddles.centres[members]))
        if len(part.places) >= 4:
            yield part


def _neighbours(saddles: Saddles) -> IntArray:
    """Return the (n, 4) neighbours along each saddle's edges, forth and back, -1 for none."""
    n = len(saddles)
    count = min(_AROUND, n - 1)
    there = KDTree(saddles.centres).query(saddles.centres, k=count + 1)[1][:, 1:].ravel()
    here = np.repeat(np.arange(n), count)
    way = saddles.centres[there] - saddles.centres[here]
    length = np.maximum(np.hypot(*way.T), 1e-9)
    angles = np.concatenate([saddles.edges, saddles.edges + np.pi], axis=1)
    edges = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    forth, off = _along(edges[here], way / length[:, None])
    back, off_back = _along(edges[there], -way / length[:, None])
    ratio = saddles.contrast[there] / saddles.contrast[here]
    # Beyond a light square on one side of an edge there is a dark one, seen from the next corner.
    fits = (off < _OFF) & (off_back < _OFF) & ((forth + back) % 2 == 1)
    fits &= (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE)
    chosen = np.flatnonzero(fits)
    cost = length * (1.0 + 2.0 * (off + off_back))
    # Of several along one edge, the last one stays.
    chosen = chosen[np.argsort(-cost[chosen], kind="stable")]
    found = np.full((n, 4), -1)
    found[here[chosen], forth[chosen]] = there[chosen]
    return found


def _along(edges: FloatArray, way: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return which of (m, 4, 2) directions (m, 2) ways follow, and the sines between them."""
    cosines = np.einsum("mki,mi->mk", edges, way)
    which = np.argmax(cosines, axis=1)
    cosine = np.take_along_axis(cosines, which[:, None], axis=1)[:, 0]
    return which, np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))


def _squares(neighbours: IntArray) -> IntArray:
    """Return the (n, 4) neighbours that are sides of closed squares, -1 for the others."""
    here = np.arange(len(neighbours))[:, None]
    nobody = np.full((1, 4), -1)
    # Index -1 takes the row that is added at the end: nobody's neighbours are nobody.
    returns = np.vstack([neighbours, nobody])[neighbours] == here[..., None]
    mutual = np.where(returns.any(axis=-1), neighbours, -1)
    back = returns.argmax(axis=-1)
    table = np.vstack([mutual, nobody])
    # From one neighbour on in the direction of the next one, and from that in the one's.
    corner = table[mutual, (back + 3) % 4]
    other = table[np.roll(mutual, -1, axis=1), (np.roll(back, -1, axis=1) + 1) % 4]
    closed = (corner >= 0) & (corner == other)
    return np.where(closed | np.roll(closed, 1, axis=1), mutual, -1)


def _settled(part: Part) -> Part:
    """Return a part without the saddles that are not where their neighbours say."""
    low = part.places.min(axis=0)
    at = tuple((part.places - low).T)
    sheet = np.full((*(part.places.max(axis=0) - low + 1), 2), np.nan)
    sheet[at] = part.pixels
    off = np.linalg.norm(_said(sheet) - sheet, axis=-1) / _pitch(sheet)
    keep = np.any(off < _ASTRAY, axis=0)[at]
    return Part(part.places[keep], part.pixels[keep])


def _pitch(sheet: FloatArray) -> FloatArray:
    """Return the (w, h) lengths of the shortest step from each point to a neighbour."""
    padded = np.pad(sheet, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    w, h = sheet.shape[:2]
    steps = [padded[1 + x : 1 + x + w, 1 + y : 1 + y + h] - sheet for x, y in _STEPS]
    lengths = np.stack([np.linalg.norm(step, axis=-1) for step in steps])
    return np.asarray(np.min(np.where(np.isnan(lengths), np.inf, lengths), axis=0))


def _said(sheet: FloatArray) -> FloatArray:
    """Return the (6, w, h, 2) places that pairs of points in line give to those of a lattice."""
    padded = np.pad(sheet, ((2, 2), (2, 2), (0, 0)), constant_values=np.nan)
    w, h = sheet.shape[:2]

    def shifted(x: int, y: int) -> FloatArray:
        return padded[2 + x : 2 + x + w, 2 + y : 2 + y + h]

    between = [0.5 * (shifted(x, y) + shifted(-x, -y)) for x, y in _STEPS[:2]]
    beyond = [2.0 * shifted(x, y) - shifted(2 * x, 2 * y) for x, y in _STEPS]
    return np.stack(between + beyond)


def _mean_said(sheet: FloatArray) -> FloatArray:
    """Return the (w, h, 2) means of what is said, NaN where nothing is."""
    said = _said(sheet)
    given = np.isfinite(said)
    count = given.sum(axis=0)
    total = np.where(given, said, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))
