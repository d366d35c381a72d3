"""What the residuals are put down to: robot, camera, intrinsics, plate, or timing."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SmoothResiduals:
    """What smooth surfaces explain of the residuals in the images.

    Attributes:
        pixel: RMS residual of one coordinate with poses and uncertain intrinsics fitted, pixels.
        pixel_left: The same with the surfaces fitted that were found.
        bow: Height of the plate's bow, peak to peak over its points, metres.
        bow_sigma: Its standard deviation.
        aspect: Pitch of the columns over that of the rows, less one, both over the declared ones.
        aspect_sigma: Its standard deviation; infinite where the views do not show it.
        shear: Departure of the plate's corners from a right angle, radians.
        shear_sigma: Its standard deviation; infinite where the views do not show it.
        plate_share: Part of the residual's squares that the plate's shape explains.
        image_share: Part that a smooth distortion of the image explains, without the plate's shape.
    """

    pixel: float
    pixel_left: float
    bow: float
    bow_sigma: float
    aspect: float
    aspect_sigma: float
    shear: float
    shear_sigma: float
    plate_share: float
    image_share: float


@dataclass(frozen=True)
class BlameShares:
    """The mean squares of the stations' residuals, divided among their causes.

    A share is between 0 and 1, those of one kind sum up to 1, and None says that it is not known.

    Attributes:
        rotation: RMS rotation of the residuals that all causes together lead to expect, radians.
        translation: RMS translation, metres.
        robot_rotation: Share of the noise of the robot's poses in the rotation.
        robot_translation: The same in the translation.
        camera_rotation: Share of the pixel noise, or of the camera's noise where it was given.
        camera_translation: The same in the translation.
        intrinsics_rotation: Share of the intrinsics' error, and of what they do not model.
        intrinsics_translation: The same in the translation.
        plate_rotation: Share of the plate's shape.
        plate_translation: The same in the translation.
        timing_rotation: Share of a time between pose and image.
        timing_translation: The same in the translation.
        limit: `robot`, `camera`, `intrinsics`, `plate`, `timing`, or `unclear`.
        words: The same for people, with the evidence.
    """

    rotation: float
    translation: float
    robot_rotation: float | None = None
    robot_translation: float | None = None
    camera_rotation: float | None = None
    camera_translation: float | None = None
    intrinsics_rotation: float | None = None
    intrinsics_translation: float | None = None
    plate_rotation: float | None = None
    plate_translation: float | None = None
    timing_rotation: float | None = None
    timing_translation: float | None = None
    limit: str = "unclear"
    words: str = ""
