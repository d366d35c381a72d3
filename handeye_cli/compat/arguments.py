"""How OpenCV's functions take poses and give them back."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3

FloatArray = NDArray[np.float64]

_ORTHOGONAL = 1e-3
"""Largest departure of an element of `R R'` from the identity."""


class CalibrationError(InputError, cv2.error):
    """Arguments that OpenCV's functions refuse, or should; callers of OpenCV catch `cv2.error`."""


def read_poses(
    R: ArrayLike | Sequence[ArrayLike], t: ArrayLike | Sequence[ArrayLike], name: str
) -> FloatArray:
    """Return the (N, 4, 4) poses of N rotations and N translations.

    Args:
        R: Matrices (3, 3) or rotation vectors (3,), (3, 1), (1, 3) in radians, also mixed.
        t: Vectors (3,), (3, 1) or (1, 3).
        name: What follows `R_` and `t_` in the arguments' names.

    Raises:
        CalibrationError: Something is not of this form; the message has argument and station.
    """
    turns, shifts = _items(R, f"R_{name}"), _items(t, f"t_{name}")
    if len(turns) != len(shifts):
        raise CalibrationError(
            f"expected as many rotations as translations, found {len(turns)} and {len(shifts)}",
            where=f"R_{name}, t_{name}",
        )
    matrices = [_rotation(item, f"R_{name}[{i}]") for i, item in enumerate(turns)]
    vectors = [_vector(item, f"t_{name}[{i}]") for i, item in enumerate(shifts)]
    nearest = rotations.project_to_so3(np.reshape(matrices, (-1, 3, 3)))
    return se3.from_parts(nearest, np.reshape(vectors, (-1, 3)))


def _items(values: ArrayLike | Sequence[ArrayLike], where: str) -> list[FloatArray]:
    """Return the stations' arrays as numbers."""
    if values is None or not np.iterable(values):
        raise CalibrationError(f"expected one array per station, found {values!r}", where=where)
    try:
        return [np.asarray(value, dtype=np.float64) for value in values]
    except (TypeError, ValueError) as error:
        raise CalibrationError(
            f"expected one array of numbers per station, found {error}", where=where
        ) from error


def _finite(value: FloatArray, where: str) -> FloatArray:
    if not np.all(np.isfinite(value)):
        raise CalibrationError(f"expected finite numbers, found {value.tolist()}", where=where)
    return value


def _vector(value: FloatArray, where: str) -> FloatArray:
    if value.shape not in {(3,), (3, 1), (1, 3)}:
        raise CalibrationError(
            f"expected a vector of three elements, found the shape {value.shape}", where=where
        )
    return _finite(value, where).reshape(3)


def _rotation(value: FloatArray, where: str) -> FloatArray:
    if value.shape in {(3,), (3, 1), (1, 3)}:
        return rotations.exp(_vector(value, where))
    if value.shape != (3, 3):
        raise CalibrationError(
            "expected a (3, 3) matrix or a rotation vector of three elements, found the shape "
            f"{value.shape}",
            where=where,
        )
    apart = float(np.max(np.abs(_finite(value, where) @ value.T - np.eye(3))))
    if apart > _ORTHOGONAL or np.linalg.det(value) < 0.0:
        raise CalibrationError(
            f"expected a rotation matrix, found {value.tolist()}, whose R R' departs from the "
            f"identity by {apart:.2g} and whose determinant is {np.linalg.det(value):.3g}",
            where=where,
        )
    return value


def deliver(
    pose: FloatArray, R: FloatArray | None, t: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Return the (3, 3) rotation and the (3, 1) translation, in the given arrays where they fit.

    Args:
        pose: (4, 4) pose.
        R: Array to be filled; a fresh one is returned unless it is (3, 3) and float64.
        t: The same for (3, 1) or (3,).
    """
    return _filled(R, pose[:3, :3], {(3, 3)}), _filled(t, pose[:3, 3:], {(3, 1), (3,)})


def _filled(out: FloatArray | None, value: FloatArray, shapes: set[tuple[int, ...]]) -> FloatArray:
    fits = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.shape in shapes
    if out is None or not fits:
        return value.copy()
    out[...] = value.reshape(out.shape)
    return out
