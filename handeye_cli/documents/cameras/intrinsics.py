"""What every form of camera file comes down to, and how its numbers are read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from handeye_cli.documents.complaints import describe
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import Camera, FloatArray

_LARGEST = 1e9
_TILTED = 14
"""OpenCV's tilted model: two angles of the sensor behind the twelve coefficients that we have."""
_RATIONAL = (8, 12, _TILTED)
_COUNTS = {"plumb_bob": (0, 4, 5), "rational_polynomial": _RATIONAL, "equidistant": (0, 4)}
"""Numbers of coefficients a model may be written with."""


@dataclass(frozen=True)
class Intrinsics:
    """Intrinsics as a file has them.

    Attributes:
        focal: Focal lengths along x and y, pixels.
        centre: Principal point, pixel (0, 0) being the centre of the top-left pixel.
        distortion: Coefficients in OpenCV's order for the model.
        model: One of ours.
        size: Width and height of the images, or None where the file does not say.
        covariance: (4 + k, 4 + k) as a `Camera` has it, or None.
    """

    focal: tuple[float, float]
    centre: tuple[float, float]
    distortion: tuple[float, ...]
    model: str
    size: tuple[int, int] | None
    covariance: FloatArray | None = None

    def camera(self, size: tuple[int, int]) -> Camera:
        """Return the camera of images of some width and height."""
        return Camera(
            *size, *self.focal, *self.centre, self.distortion, self.model, self.covariance
        )


Cameras = Mapping[str, Callable[[], Intrinsics]]
"""What reads each camera of a file, by its name there; one that is not asked for is not read."""


def number(value: Any, place: Place) -> float:
    """Return a finite number.

    Raises:
        InputError: It is none.
    """
    if not isinstance(value, int | float | Decimal) or isinstance(value, bool):
        raise InputError(f"expected a number, found {describe(value)}", where=str(place))
    plain = float(value)
    if not abs(plain) <= _LARGEST:
        raise InputError(
            f"expected a finite number (of at most {_LARGEST:g}), found {value}", where=str(place)
        )
    return plain


def numbers(value: Any, place: Place) -> list[float]:
    """Return a list of numbers, however deep lists of one are nested in it, row by row.

    Raises:
        InputError: It is no list, or holds something else.
    """
    if not isinstance(value, list):
        raise InputError(f"expected a list of numbers, found {describe(value)}", where=str(place))
    flat: list[float] = []
    for index, item in enumerate(value):
        at = place.item(index)
        flat += numbers(item, at) if isinstance(item, list) else [number(item, at)]
    return flat


def elements(value: Any) -> Any:
    """Return the list of a matrix that is a mapping of rows, cols and data, as FileStorage has it.

    Anything else comes back as it is.
    """
    return value["data"] if isinstance(value, dict) and "data" in value else value


def exactly(count: int, value: Any, place: Place) -> list[float]:
    """Return a list of so many numbers.

    Raises:
        InputError: It is none, or has another length.
    """
    found = numbers(value, place)
    if len(found) != count:
        raise InputError(f"expected {count} numbers, found {len(found)}", where=str(place))
    return found


def focal_lengths(values: Sequence[float], place: Place) -> tuple[float, float]:
    """Return the two focal lengths.

    Raises:
        InputError: One is not above 0.
    """
    fx, fy = values
    if min(fx, fy) <= 0.0:
        raise InputError(
            f"expected focal lengths above 0 px, found {fx:g} and {fy:g}",
            where=str(place),
            hint="the camera is not calibrated" if fx == fy == 0.0 else None,
        )
    return fx, fy


def image_size(value: list[Any], place: Place) -> tuple[int, int]:
    """Return the width and height of images in whole pixels.

    Raises:
        InputError: They are no two whole numbers above 0.
    """
    sides = exactly(2, value, place)
    if min(sides) < 1.0 or any(math.floor(side) != side for side in sides):
        raise InputError(
            f"expected the width and height of images in pixels, found {sides[0]:g} and "
            f"{sides[1]:g}",
            where=str(place),
        )
    return int(sides[0]), int(sides[1])


def lens(
    name: str, coefficients: Sequence[float], models: Mapping[str, str], place: Place
) -> tuple[str, tuple[float, ...]]:
    """Return our distortion model and its coefficients.

    Args:
        name: The model as the file calls it.
        coefficients: As the file has them.
        models: Our models by the names that this form of file has for them.
        place: Where they stand.

    Raises:
        InputError: The model is none of ours, or has another number of coefficients.
    """
    if not isinstance(name, str) or name not in models:
        raise InputError(
            f"expected a distortion model out of {', '.join(models)}, found {name!r}",
            where=str(place),
            hint="calibrate the camera with one of these models, or rectify the images",
        )
    model = models[name]
    if len(coefficients) not in _COUNTS[model]:
        counts = " or ".join(map(str, _COUNTS[model]))
        raise InputError(
            f"expected {counts} coefficients of {name}, found {len(coefficients)}",
            where=str(place),
        )
    if len(coefficients) == _TILTED:
        _refuse_tilt(coefficients[-2:], place)
        coefficients = coefficients[:-2]
    return model, tuple(coefficients)


def _refuse_tilt(angles: Sequence[float], place: Place) -> None:
    if any(angles):
        raise InputError(
            "expected up to 12 coefficients, found the 14 of the tilted model, with angles of "
            f"{angles[0]:g} and {angles[1]:g} rad",
            where=str(place),
            hint="calibrate the camera without the tilted model",
        )
