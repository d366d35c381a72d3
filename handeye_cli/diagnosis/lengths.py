"""Lengths of the robot against those of the camera: wrong units, or a target of another size."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.diagnosis.fits import Fit
from handeye_cli.geometry import statistics
from handeye_cli.records import Finding, TargetSpec
from handeye_cli.records.hypotheses import LengthRatio

_CORRELATED = 0.9
"""Correlation below which noise of one side alone may change the ratio by a tenth."""
_SIGNIFICANT = 6.0
"""The same for few stations, in standard deviations of Fisher's transform."""
_EXPLAINED = 0.15
"""Natural logarithm of a ratio that wrong intrinsics still explain."""
_NO_DIFFERENCE = 3.0
"""Standard deviations up to which a ratio is called 1."""
_CERTAIN = 8.0
"""Standard deviations by which a ratio has to differ from 1: not all errors are noise."""
_NEAR_FACTOR = 0.2
"""Natural logarithm within which a ratio is that of a pair of units."""
_NEAR_SIZE = 0.03
"""Share by which a size may miss a round one: intrinsics scale lengths as well."""
_FARTHEST = 50.0
"""Metres between the frames of a robot cell, at most."""
_INCH_MM = 25.4
_STEPS_MM = (5.0, 1.0)
"""Multiples of these are round sizes, where a size is four times as large or more."""
_FINEST_MM = 0.1
"""Of a smaller size."""
_PERCENT = 0.01
LENGTHS_NOT_CHECKED = "lengths-not-checked"
_CHECK_LENGTHS = (
    "measure the target over its whole length; stations at another distance from it, as of a "
    "second 'handeye plan' with another --distance, would check it"
)
_SIZES = ("spacing_mm", "square_mm", "size_mm")
"""Keys of targets that say how large they are; a target has one of them."""


class LengthFault(NamedTuple):
    """What is wrong with lengths, and what would put it right.

    Attributes:
        description: In words, to follow "if".
        flag: What says so on the command line; empty where no flag does it.
        finding: For the verdict.
    """

    description: str
    flag: str
    finding: Finding


class _Unit(NamedTuple):
    """A well-known ratio of lengths, the robot's over the camera's."""

    factor: float
    description: str
    flag: str = ""


_UNITS = (
    _Unit(1e3, "the robot's translations are in millimetres", "--pose-units mm"),
    _Unit(1e-3, "the robot's translations are in metres and not in millimetres", "--pose-units m"),
    _Unit(1e2, "the robot's translations are in centimetres"),
    _Unit(1e1, "the target's lengths are in centimetres and not in millimetres"),
    _Unit(1e-1, "the robot's translations are in centimetres and not in millimetres"),
    _Unit(1e3 / _INCH_MM, "the robot's translations are in inches"),
    _Unit(_INCH_MM, "the target's lengths are in inches and not in millimetres"),
    _Unit(1.0 / _INCH_MM, "the robot's translations are in inches and not in millimetres"),
    _Unit(1e3 / (12.0 * _INCH_MM), "the robot's translations are in feet"),
)


def length_ratio(fit: Fit) -> LengthRatio:
    """Return the ratio of lengths under a reading, as far as its motions tell it.

    Noise that is fitted as if it were motion makes a ratio of its own, so what both sides say has
    to go together.
    """
    freedom = max(fit.freedom - 1, 1)
    correlation = min(fit.correlation, 1.0 - 1e-15)
    significance = math.atanh(max(correlation, 0.0)) * math.sqrt(max(freedom - 1, 1))
    if correlation < _CORRELATED or significance < _SIGNIFICANT:
        return LengthRatio(1.0, math.inf)
    spread = (1.0 - correlation**2) / (correlation**2 * freedom)
    return LengthRatio(fit.ratio, math.sqrt(spread))


def ratio_words(scale: LengthRatio) -> str:
    """Return a ratio of lengths for people, with what to think of one that is no fault.

    Args:
        scale: The ratio, which the motions tell.
    """
    words = (
        f"the robot's motions are {scale.ratio:.4f} times as long as the camera's "
        f"(+- {100 * scale.sigma:.2f} %)"
    )
    apart = abs(math.log(scale.ratio))
    if apart <= _NO_DIFFERENCE * scale.sigma:
        return f"{words}: as long, within this doubt"
    if apart <= _EXPLAINED:
        return f"{words}: the target's size, the intrinsics or the robot may be off by so much"
    return words


def length_fault(
    fit: Fit, scale: LengthRatio, target: TargetSpec | None, *, from_pixels: bool
) -> LengthFault | None:
    """Return what is wrong with the lengths under a reading, or None where nothing is.

    Args:
        fit: The reading.
        scale: Its ratio of lengths.
        target: What the target was declared to be, or None when unknown.
        from_pixels: Whether the target's poses were computed from its lengths.
    """
    apart = abs(math.log(scale.ratio))
    if apart <= _EXPLAINED or min(apart, 1.0) <= _CERTAIN * scale.sigma:
        return _too_far(fit, from_pixels=from_pixels)
    unit = min(_UNITS, key=lambda each: abs(math.log(scale.ratio / each.factor)))
    near = _NEAR_FACTOR if abs(math.log10(unit.factor)) < 3.0 else math.log(2.0)
    found = (
        f"the robot's motions are {scale.ratio:.4g} times as long as the camera's "
        f"(+- {100.0 * scale.sigma:.2g} %)"
    )
    if abs(math.log(scale.ratio / unit.factor)) <= near:
        return _units(unit, f"{found}; they agree if {unit.description}", from_pixels=from_pixels)
    return _target_size(scale, found, target)


def unchecked_lengths(
    fit: Fit, scale: LengthRatio, target: TargetSpec | None, answer: str
) -> Finding | None:
    """Return what a target of another size would do unseen, or None where it would be seen.

    Seen is what `length_fault` refuses. On a circle of stations about the target, as the paper's,
    no motion shifts along the axis that it turns about, and nothing tells the size.

    Args:
        fit: The reading that the stations agree on.
        scale: Its ratio of lengths.
        target: What the target was declared to be, or None when unknown.
        answer: Name of the transform that is looked for.
    """
    unseen = _CERTAIN * scale.sigma
    if unseen <= _EXPLAINED:
        return None
    what = "the target's size" if target else "the size of the target behind its poses"
    if unseen < 1.0:
        limit = f"only to {100.0 * math.expm1(unseen):.2g} %"
        seen = f"check {what} against the robot's lengths {limit}: a smaller error is not seen"
    else:
        seen = f"do not check {what} against the robot's lengths: any would fit"
    moved = _PERCENT * float(np.linalg.norm(fit.by_camera))
    message = f"the stations {seen}, and each per cent of it moves {answer} by {moved / MM:.2g} mm"
    return Finding(LENGTHS_NOT_CHECKED, "info", message, _CHECK_LENGTHS)


def _units(unit: _Unit, message: str, *, from_pixels: bool) -> LengthFault:
    flag = unit.flag if from_pixels else ""
    if flag:
        advice = f"say {flag} where the robot's poses are read, or check the lengths of the target"
    else:
        advice = "write the translations of robot and target in one unit, m or mm"
    return LengthFault(unit.description, flag, Finding("pose-units", "error", message, advice))


def _too_far(fit: Fit, *, from_pixels: bool) -> LengthFault | None:
    """Refuse distances no robot cell has; on a circle about the target nothing else tells units."""
    away = statistics.median(np.linalg.norm(fit.hypothesis.B[:, :3, 3], axis=1))
    distances = {
        "the target is {} m away from the camera": away,
        "the camera would be {} m away from its mount": float(np.linalg.norm(fit.t_X)),
        "the target would be {} m away from the frame it is fixed to": float(
            np.linalg.norm(fit.t_Z)
        ),
    }
    too_far = [text.format(f"{size:.0f}") for text, size in distances.items() if size > _FARTHEST]
    if not too_far:
        return None
    both = away > _FARTHEST
    if both and from_pixels:
        description, flag = "the target's lengths are a thousandth of those declared", ""
        advice = "check the lengths of the target with --target"
    else:
        description = f"the {'document' if both else 'robot'}'s translations are in millimetres"
        flag = "--pose-units mm" if both or from_pixels else ""
        advice = f"say {flag}" if flag else "write all translations in one unit, m or mm"
    message = f"expected distances within {_FARTHEST:g} m, but {too_far[0]}"
    return LengthFault(description, flag, Finding("pose-units", "error", message, advice))


def _target_size(scale: LengthRatio, found: str, target: TargetSpec | None) -> LengthFault:
    key = next((key for key in _SIZES if target and key in target.parameters), None)
    if target is None or key is None:
        description = f"the target is {scale.ratio:.4g} times as large as its poses say"
        advice = "measure the target, and compute its poses with its true size"
        return _target_fault(description, f"{found}; they agree if {description}", advice)
    name, declared = key.removesuffix("_mm"), float(target.parameters[key])
    fitting = declared * scale.ratio
    description = f"the target's {name} is {fitting:.4g} mm and not {declared:g} mm"
    near = _round_sizes(fitting)
    rounded = f", the round sizes near that are {' and '.join(near)}" if near else ""
    advice = f"measure the target's {name}, and say it with --target"
    return _target_fault(description, f"{found}; they agree if {description}{rounded}", advice)


def _target_fault(description: str, message: str, advice: str) -> LengthFault:
    return LengthFault(description, "--target", Finding("target-scale", "error", message, advice))


def _round_sizes(size_mm: float) -> list[str]:
    """Return the round sizes, in mm and in inches, that a size may be meant to be."""
    quarter = _INCH_MM / 4.0
    step = next((step for step in _STEPS_MM if size_mm >= 4.0 * step), _FINEST_MM)
    metric = step * round(size_mm / step)
    inches = quarter * round(size_mm / quarter)
    names = {metric: f"{metric:g} mm"}
    if inches > 0.0:
        names[inches] = f"{inches:.4g} mm ({inches / _INCH_MM:g} in)"
    near = [each for each in names if abs(each / size_mm - 1.0) <= _NEAR_SIZE]
    return [names[each] for each in sorted(near, key=lambda each: abs(each - size_mm))]
