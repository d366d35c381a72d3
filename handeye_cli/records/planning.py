"""What a plan tells beside its stations: what it rests on, what was changed, and what it gains."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlanBasis:
    """Where the numbers come from that the prediction of a plan rests on.

    Attributes:
        robot: Noise of the robot's poses: `given`, `calibration`, `recording` or `paper`.
        camera: Noise of the camera's poses: one of these, or `pixels` where it follows from the
            noise of the pixels at each station.
        mount: `calibration` where the camera's place is known, `recording` where it was solved for,
            `lever` where only its distance from the gripper is.
        lever: That distance, metres; the prediction is then averaged over its directions.
    """

    robot: str
    camera: str
    mount: str
    lever: float | None = None


@dataclass(frozen=True)
class CircleError:
    """The paper's layout with as many stations, to compare a plan with.

    Attributes:
        rotation: RMS error of the answer's rotation it would lead to, radians.
        translation: The same of the translation, metres.
        allowed: Whether all of its stations keep the limits.
    """

    rotation: float
    translation: float
    allowed: bool


@dataclass(frozen=True)
class MovedStation:
    """A station of the paper's layout that was moved, since it broke a limit where it was.

    Attributes:
        name: Name of the station.
        limits: What it broke, such as `view` or `box`.
        rotation: Angle it was turned by, radians.
        translation: Distance the camera was moved by, metres.
    """

    name: str
    limits: tuple[str, ...]
    rotation: float
    translation: float


@dataclass(frozen=True)
class Gain:
    """What one more station is worth, after those before it in the plan.

    Attributes:
        name: Name of the station.
        rotation_before: RMS error of the answer's rotation without it, radians.
        translation_before: The same of the translation, metres.
        rotation: RMS error of the rotation with it, radians.
        translation: The same of the translation, metres.
    """

    name: str
    rotation_before: float
    translation_before: float
    rotation: float
    translation: float
