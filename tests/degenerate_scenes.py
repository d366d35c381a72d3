"""Perfect stations that leave directions of the answer free, and which these are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scenes import Scene, scene, stations, unit

from handeye_cli.chain import Chain, chain_of
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import FloatArray, Noise, Stations

NO_NOISE = Noise(1e-15, 1e-15, 1e-15, 1e-15)
LOW = Noise(3e-4, 1e-4, 1e-4, 3e-5)
HIGH = Noise(3e-3, 1e-3, 1e-3, 3e-4)
COUNTS = {
    "one axis": (1, 1),
    "scara": (0, 1),
    "translations": (0, 3),
    "one translation": (1, 3),
    "identical poses": (3, 3),
    "two stations": (1, 1),
    "second axis in the noise": (1, 1),
}
"""Free rotations and translations of each kind of scene."""


@dataclass(frozen=True)
class Degenerate(Scene):
    """Stations whose motions have one direction `axis`, in the mount's frame, or none."""

    axis: FloatArray


def degenerate(
    kind: str,
    rng: np.random.Generator,
    count: int = 8,
    *,
    axis: FloatArray | None = None,
    noise: Noise = NO_NOISE,
) -> Degenerate:
    """Stations of a kind in `COUNTS`; the noise is what hides a second axis."""
    axis = unit(rng) if axis is None else np.asarray(axis)
    count = 2 if kind == "two stations" else count
    motions = se3.from_parts(np.eye(3), np.zeros((count, 3)))
    if kind in ("one axis", "scara", "two stations", "second axis in the noise"):
        turns = rotations.exp(np.linspace(0.0, 1.5, count)[:, None] * axis)
        centre = 0.3 * unit(rng)
        motions = se3.from_parts(turns, centre - turns @ centre)
    if kind in ("scara", "translations"):
        motions[:, :3, 3] += 0.1 * rng.normal(size=(count, 3))
    if kind == "one translation":
        motions[:, :3, 3] += np.linspace(0.0, 0.3, count)[:, None] * axis
    if kind == "two stations":
        motions[1, :3, 3] += 0.1 * axis
    if kind == "second axis in the noise":
        tilts = 0.3 * max(noise.robot_rotation, 1e-9) * rng.normal(size=(count, 3))
        motions = motions @ se3.from_parts(rotations.exp(tilts), np.zeros(3))
    base = scene(rng, 3)
    start = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.5 * rng.normal(size=3))
    A = start @ motions
    B = se3.inverse(base.X) @ se3.inverse(A) @ base.Z
    return Degenerate(A, B, base.X, base.Z, axis)


def chain_of_any(document: Stations) -> Chain:
    """The chain of a document, of two stations too."""
    if len(document.stations) > 2:
        return chain_of(document)
    twice = replace(document, stations=document.stations * 2)
    return chain_of(twice).part(slice(len(document.stations)))


def noisy(
    kind: str, seed: int, noise: Noise, *, setup: Setup = Setup.EYE_IN_HAND, **options: object
) -> tuple[Degenerate, Stations, Chain]:
    """A scene of a kind with its noisy document; `options` are those of `stations`."""
    rng = np.random.default_rng(seed)
    perfect = degenerate(kind, rng, noise=noise)
    document = stations(rng, perfect, noise, setup=setup, **options)
    return perfect, document, chain_of_any(document)


def free_twists(perfect: Scene) -> FloatArray:
    """The (k, 6) twists (v, w) of the mount's frame that no motion changes: `Ad_M xi = xi`.

    They leave every station's loop closed, `A Exp(xi) X B = Exp(xi') Z` with one xi' for all.
    """
    motions = se3.inverse(perfect.A[:1]) @ perfect.A[1:]
    R, t = motions[:, :3, :3], motions[:, :3, 3]
    adjoint = np.zeros((len(R), 6, 6))
    adjoint[:, :3, :3] = adjoint[:, 3:, 3:] = R
    adjoint[:, :3, 3:] = rotations.skew(t) @ R
    _, size, rows = np.linalg.svd((adjoint - np.eye(6)).reshape(-1, 6))
    return rows[size < 1e-6]
