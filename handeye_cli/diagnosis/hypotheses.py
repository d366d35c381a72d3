"""The table of hypotheses: which other conventions the numbers of a document may be written in.

One function per family of mistakes, in the order in which equally good explanations are preferred.
Of the direction of poses there is one bit only: robot poses the other way round, the camera on the
other side, and target poses the other way round are the same equations, with X and Z exchanged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from handeye_cli.conventions import QuaternionOrder, RobotPoses, Setup
from handeye_cli.diagnosis.readings import EulerNumbers, Reading, with_other_quaternion_order
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.motion_invariants import BoolArray
from handeye_cli.records import FloatArray

DECLARED = "declared"
MOVED = "target-moved"
AS_DECLARED = (DECLARED, MOVED)
"""Codes of hypotheses that read the numbers as they were declared."""
_SAME_DIGITS = 6
"""Decimals to which rotations agree that are the same reading."""
_AXES = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
_EULER_ORDERS = (*_AXES, *(axes.upper() for axes in _AXES))


@dataclass(frozen=True)
class Hypothesis:
    """One way to read the numbers.

    Attributes:
        code: Stable short name in kebab-case.
        description: In words, to follow "if".
        flag: What says so on the command line; empty where no flag does it.
        advice: The next step if it is true.
        A: (N, 4, 4) reference_T_mount.
        B: (N, 4, 4) camera_T_target.
        mask: (N,) which stations take part.
        paired_anew: Whether other poses are put together, and not only read in another way.
        more_unknowns: Numbers in rotation, and as many in translation, that it has fitted already.
    """

    code: str
    description: str
    flag: str
    advice: str
    A: FloatArray
    B: FloatArray
    mask: BoolArray
    paired_anew: bool = False
    more_unknowns: int = 0


def declared(reading: Reading) -> Hypothesis:
    """Return the numbers as they were declared."""
    A = reading.reference_T_mount(reading.robot[reading.index], inverted=reading.inverted)
    return _of_all(DECLARED, "all is as declared", A, reading.camera)


def conventions(reading: Reading) -> list[Hypothesis]:
    """Return what other conventions make of the numbers."""
    euler = () if reading.euler is None else _eulers(reading, reading.euler)
    return [*_directions(reading), *_quaternions(reading), *euler, *_mirrors(reading)]


def _of_all(
    code: str, description: str, A: FloatArray, B: FloatArray, *, flag: str = "", advice: str = ""
) -> Hypothesis:
    return Hypothesis(code, description, flag, advice, A, B, np.ones(len(B), dtype=bool))


class _Direction(NamedTuple):
    """A direction of the robot's poses: as declared, or the other.

    Attributes:
        suffix: Of the code.
        words: Of the description, to follow "and".
        flag: What is to be said for it.
        inverted: Whether the poses are base-in-gripper then.
    """

    suffix: str
    words: str
    flag: str
    inverted: bool


def _both_directions(reading: Reading) -> tuple[_Direction, _Direction]:
    named = RobotPoses.GRIPPER_IN_BASE if reading.inverted else RobotPoses.BASE_IN_GRIPPER
    other = _Direction(
        "-and-direction",
        f" and the robot poses {named}",
        f"--robot-poses {named}",
        not reading.inverted,
    )
    return _Direction("", "", "", reading.inverted), other


def _directions(reading: Reading) -> Iterator[Hypothesis]:
    _, other = _both_directions(reading)
    setup = Setup.EYE_TO_HAND if reading.setup is Setup.EYE_IN_HAND else Setup.EYE_IN_HAND
    flags = f"{other.flag} or --setup {setup}"
    description = f"the robot poses are {other.flag.split()[-1]}, or the setup is {setup}"
    advice = f"no data can tell these apart, as they are the same equations: say {flags}"
    if not reading.from_pixels:
        description += ", or the target poses are target_T_camera"
        advice += ", or invert the target poses in the document"
    yield _of_all(
        "mounting-or-direction",
        description,
        reading.reference_T_mount(reading.robot[reading.index], inverted=other.inverted),
        reading.camera,
        flag=flags,
        advice=f"{advice}, whichever is true",
    )


def _mirrors(reading: Reading) -> Iterator[Hypothesis]:
    """Mirroring a frame turns rotations as a half turn does, and translations the other way."""
    mirrored = reading.robot[reading.index].copy()
    mirrored[:, :3, 3] *= -1.0
    yield _of_all(
        "left-handed-frame",
        "the robot's frames are left-handed",
        reading.reference_T_mount(mirrored, inverted=reading.inverted),
        reading.camera,
        advice="check the signs of the robot's axes: one of them points the wrong way",
    )


def _quaternions(reading: Reading) -> Iterator[Hypothesis]:
    """Quaternions of the robot, of the camera, or of both, in the other order."""
    wxyz = reading.quaternion_order is QuaternionOrder.XYZW
    order = QuaternionOrder.WXYZ if wxyz else QuaternionOrder.XYZW
    robot, camera = reading.robot[reading.index], reading.camera
    other_robot, other_camera = (
        with_other_quaternion_order(poses, reading.quaternion_order) for poses in (robot, camera)
    )
    flag = f"--quaternion-order {order}"
    if reading.from_pixels:
        # A flag where stations are read turns the target poses of the document as well.
        sides = [
            ("the robot's quaternions", other_robot, camera, flag),
            ("the quaternions", other_robot, other_camera, flag),
        ]
    else:
        sides = [
            ("the quaternions", other_robot, other_camera, flag),
            ("only the robot's quaternions", other_robot, camera, ""),
            ("only the target poses' quaternions", robot, other_camera, ""),
        ]
    if reading.euler is not None:
        sides = [side for side in sides if side[1] is robot]
    for (whose, A, B, said), direction in product(sides, _both_directions(reading)):
        flags = f"{said} {direction.flag}".strip() if said else ""
        advice = f"say {flags}" if said else _in_one_order(direction)
        yield _of_all(
            f"quaternion-order{direction.suffix}",
            f"{whose} are {order}{direction.words}",
            reading.reference_T_mount(A, inverted=direction.inverted),
            B,
            flag=flags,
            advice=advice,
        )


def _in_one_order(direction: _Direction) -> str:
    advice = "write all quaternions of a document in one order"
    return f"{advice}, and say {direction.flag}" if direction.flag else advice


def _eulers(reading: Reading, euler: EulerNumbers) -> Iterator[Hypothesis]:
    """Other axes of the Euler angles, and degrees for radians; equal ones are named together."""
    values = euler.values[reading.index]
    t = reading.robot[reading.index, :3, 3]
    seen: dict[bytes, list[str]] = {}
    rows = []
    for degrees in (euler.degrees, not euler.degrees):
        angles = np.deg2rad(values) if degrees else values
        for order in (euler.order, *(each for each in _EULER_ORDERS if each != euler.order)):
            R = rotations.matrix_from_euler(angles, order)
            names = seen.setdefault((np.round(R, _SAME_DIGITS) + 0.0).tobytes(), [])
            names.append(order)
            if len(names) == 1:
                rows.append((degrees, names, R))
    for (degrees, names, R), direction in product(rows[1:], _both_directions(reading)):
        unit = "degrees" if degrees else "radians"
        said = [f"order {' or '.join(names)}"] if names[0] != euler.order else []
        said += [f"in {unit}"] if degrees is not euler.degrees else []
        yield _of_all(
            _euler_code(euler, names[0], degrees) + direction.suffix,
            f"the Euler angles are {' and '.join(said)}{direction.words}",
            reading.reference_T_mount(se3.from_parts(R, t), inverted=direction.inverted),
            reading.camera,
            advice=f"write order: {names[0]} and degrees: {str(degrees).lower()} beside euler:"
            + (f", and say {direction.flag}" if direction.flag else ""),
        )


def _euler_code(euler: EulerNumbers, order: str, degrees: bool) -> str:
    if degrees is euler.degrees:
        return "euler-order"
    unit = "degrees-as-radians" if degrees else "radians-as-degrees"
    return unit if order == euler.order else f"euler-order-and-{unit}"
