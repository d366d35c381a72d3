"""What a user should know about a recording that can be used all the same."""

from __future__ import annotations

from handeye_cli.records import Finding


def cut() -> Finding:
    """The end of the file is missing."""
    return Finding(
        "recording-cut",
        "warning",
        "the end of the recording is missing; what comes before the cut is used",
        "check that no station is missing; copy the file or record again",
    )


def transforms_dropped(count: int) -> Finding:
    """Some transforms or poses are not valid."""
    return Finding(
        "transforms-dropped",
        "warning",
        f"{count} transforms are not used: no unit quaternion, not finite, or without two"
        " different frames",
        "find out which node sends them",
    )


def camera_info_missing(image_topic: str) -> Finding:
    """No intrinsics belong to the images."""
    return Finding(
        "camera-info-missing",
        "warning",
        f"no CameraInfo belongs to {image_topic}",
        "name its topic with --camera-info-topic, or give intrinsics of your own",
    )


def camera_uncalibrated(topic: str) -> Finding:
    """The intrinsics say that there are none."""
    return Finding(
        "camera-uncalibrated",
        "warning",
        f"{topic} says that the camera is not calibrated (its focal length is 0)",
        "calibrate the camera before recording, or give intrinsics of your own",
    )


def camera_info_changes(topic: str, count: int) -> Finding:
    """There are several different intrinsics."""
    return Finding(
        "camera-info-changes",
        "warning",
        f"{topic} has {count} different intrinsics; the first are used",
        "fix focus, zoom and region of the camera while recording",
    )


def clock_log_time(reason: str) -> Finding:
    """The stamps of images and poses cannot be compared."""
    return Finding(
        "clock-log-time",
        "warning",
        f"{reason}, so the times of recording are used, which include delays of transport",
        "synchronise the clocks and record header stamps, or correct a delay with --time-offset",
    )


def choices(base: str, gripper: str, image_topic: str) -> Finding:
    """What was taken from the recording."""
    return Finding(
        "recording-choices",
        "info",
        f"base {base!r}, gripper {gripper!r}, images {image_topic}",
        "choose others with --base-frame, --gripper-frame, --pose-topic or --image-topic",
    )


def frames_moving(unused: int, total: int) -> Finding:
    """Some frames are of no station."""
    return Finding(
        "frames-moving",
        "info",
        f"{unused} of {total} frames are not used: the robot moved, or its pose is not known",
    )


def pauses_without_image(empty: int, total: int) -> Finding:
    """Some pauses are no station."""
    return Finding(
        "pauses-without-image",
        "warning",
        f"{empty} of {total} pauses have no image",
        "let the robot stand still longer than the time between two images",
    )
