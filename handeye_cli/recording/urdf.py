"""A robot's links and joints, read from its description (URDF)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from handeye_cli import markup
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3
from handeye_cli.recording.layout import LARGEST
from handeye_cli.records import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

FIXED = "fixed"
_TURNING = ("revolute", "continuous")
_SLIDING = "prismatic"
_LEFT_OUT = ("floating", "planar")
"""Joints of more than one number, for which the state of a joint has no room."""
_TYPES = (FIXED, *_TURNING, _SLIDING, *_LEFT_OUT)
_SHORTEST_AXIS = 1e-9


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another: `multiplier * value + offset`.

    Attributes:
        joint: The other one.
        multiplier: Without a unit, or metres per radian and the like.
        offset: Radians or metres.
    """

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """How a link hangs from another.

    Attributes:
        name: Its name in the state of the joints.
        parent: Name of the link above.
        child: Name of the link below.
        origin: (4, 4) `parent_T_child` at the value 0.
        turn: (3,) radians per value about axes of the child, zero unless it turns.
        slide: (3,) metres per value along axes of the child, zero unless it slides.
        mimic: What it follows, or None when it has a value of its own.
    """

    name: str
    parent: str
    child: str
    origin: FloatArray
    turn: FloatArray
    slide: FloatArray
    mimic: Mimic | None = None

    @property
    def fixed(self) -> bool:
        """Whether it never moves."""
        return not (self.turn.any() or self.slide.any())

    def at(self, values: FloatArray) -> FloatArray:
        """Return (n, 4, 4) `parent_T_child` at (n,) values, radians or metres."""
        motion = se3.from_parts(
            rotations.exp(values[:, None] * self.turn), values[:, None] * self.slide
        )
        return np.asarray(self.origin @ motion)


def parse(text: str, label: str) -> tuple[Joint, ...]:
    """Return the joints of a description that can be followed.

    Args:
        text: The description.
        label: Its name for error messages.

    Raises:
        InputError: It is no URDF, or a joint lacks what its type needs.
    """
    root = markup.parse(text, label)
    if root.tag != "robot":
        raise InputError(f"expected a description with <robot>, found <{root.tag}>", where=label)
    joints = [_joint(element, label) for element in root.findall("joint")]
    return tuple(joint for joint in joints if joint is not None)


def _joint(element: Element, label: str) -> Joint | None:
    name, kind = element.get("name", ""), element.get("type", "")
    where = f"{label}, joint {name!r}"
    if kind not in _TYPES:
        known = ", ".join(_TYPES)
        raise InputError(f"expected a type of joint out of {known}, found {kind!r}", where=where)
    if kind in _LEFT_OUT:
        return None
    parent, child = (_link(element, tag, where) for tag in ("parent", "child"))
    origin = element.find("origin")
    axis = np.zeros(3) if kind == FIXED else _axis(element, where)
    return Joint(
        name,
        parent,
        child,
        se3.from_parts(
            rotations.matrix_from_euler(_numbers(origin, "rpy", "0 0 0", where), "xyz"),
            _numbers(origin, "xyz", "0 0 0", where),
        ),
        turn=axis * (kind in _TURNING),
        slide=axis * (kind == _SLIDING),
        mimic=_mimic(element.find("mimic"), where),
    )


def _link(element: Element, tag: str, where: str) -> str:
    inner = element.find(tag)
    name = None if inner is None else inner.get("link")
    if not name:
        raise InputError(f"expected a {tag} link, found none", where=where)
    return name.removeprefix("/")


def _axis(element: Element, where: str) -> FloatArray:
    axis = _numbers(element.find("axis"), "xyz", "1 0 0", where)
    length = float(np.linalg.norm(axis))
    if length < _SHORTEST_AXIS:
        raise InputError(f"expected an axis with a direction, found {axis.tolist()}", where=where)
    return np.asarray(axis / length)


def _mimic(element: Element | None, where: str) -> Mimic | None:
    if element is None:
        return None
    (multiplier,) = _numbers(element, "multiplier", "1", where, count=1)
    (offset,) = _numbers(element, "offset", "0", where, count=1)
    return Mimic(element.get("joint", ""), float(multiplier), float(offset))


def _numbers(
    element: Element | None, key: str, default: str, where: str, count: int = 3
) -> FloatArray:
    text = default if element is None else element.get(key, default)
    values = _floats(text.split())
    if values is None or len(values) != count or not (np.abs(values) <= LARGEST).all():
        expected = f"{count} finite numbers" if count > 1 else "a finite number"
        raise InputError(f"expected {expected} as {key}, found {text!r}", where=where)
    return np.array(values)


def _floats(words: Sequence[str]) -> list[float] | None:
    try:
        return [float(word) for word in words]
    except ValueError:
        return None
