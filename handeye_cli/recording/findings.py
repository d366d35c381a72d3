"""What a user should know about a recording that can be used all the same."""

from __future__ import annotations

from handeye_cli.records import Finding
from handeye_cli.wording import first_few

_LISTED = 5
"""At most this many files are named."""


def _places(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"


def cut(files: int, unused_bytes: int) -> Finding:
    """The ends of some files are missing."""
    end = "the end of the recording is" if files == 1 else f"the ends of {files} files are"
    return Finding(
        "recording-cut",
        "warning",
        f"{end} missing; what comes before the cut is used"
        + (f", without the last {unused_bytes} bytes" if unused_bytes else ""),
        "check that no station is missing; copy the file or record again",
    )


def damaged(places: int, lost_bytes: int, lost_messages: int, first: str) -> Finding:
    """Parts of a file are damaged."""
    counted = f" and {lost_messages} messages" if lost_messages else ""
    return Finding(
        "recording-damaged",
        "warning",
        f"the recording is damaged in {_places(places)}: {lost_bytes} bytes{counted} are lost, the"
        f" rest is used; the first is at {first}",
        "check that no station is missing; copy the file again",
    )


def damaged_aside(places: int, first: str) -> Finding:
    """Parts of a file are damaged that nothing is read from."""
    return Finding(
        "recording-damaged",
        "info",
        f"the recording is damaged in {_places(places)} with nothing but topics that are not read,"
        f" so no answer is touched; the first is at {first}",
        "copy the file again if you need those topics",
    )


def messages_unreadable(topic: str, count: int, total: int, first: str) -> Finding:
    """Some messages of a topic are not what their schema says."""
    return Finding(
        "messages-unreadable",
        "warning",
        f"{count} of {total} messages of {topic} cannot be read: {first}",
        "find out which node sends them",
    )


def files(names: list[str]) -> Finding:
    """A recording has several files."""
    listed = first_few(names, _LISTED)
    return Finding("recording-files", "info", f"{len(names)} files in this order: {listed}")


def files_missing(names: list[str]) -> Finding:
    """Files that belong to a recording are not there."""
    listed = first_few(names, _LISTED)
    return Finding(
        "recording-files-missing",
        "warning",
        f"{len(names)} files that metadata.yaml names are not there: {listed}",
        "copy the whole folder; /tf_static is in the first file only",
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


def links_computed(count: int) -> Finding:
    """The robot's poses follow from its joints."""
    return Finding(
        "links-computed",
        "info",
        f"nothing moves in /tf: {count} links follow from the robot's joints and its description",
        "record /tf as well, or check that the description is the calibrated one of this robot",
    )


def camera_info_missing(image_topic: str) -> Finding:
    """No intrinsics belong to the images."""
    return Finding(
        "camera-info-missing",
        "warning",
        f"no CameraInfo belongs to {image_topic}",
        "name its topic with --camera-info-topic, or give intrinsics of your own",
    )


def camera_uncalibrated(topic: str, *, rectified: bool) -> Finding:
    """The intrinsics say that there are none, or none for rectified images."""
    if rectified:
        found = "does not say how the images are rectified (the focal length in its P is 0)"
        advice = "use the raw images with --image-topic, or give intrinsics of your own"
    else:
        found = "says that the camera is not calibrated (its focal length is 0)"
        advice = "calibrate the camera before recording, or give intrinsics of your own"
    return Finding("camera-uncalibrated", "warning", f"{topic} {found}", advice)


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


def stations_moving(stations: int, total: int, pauses: int) -> Finding:
    """Stations are frames that were taken while the robot moved."""
    standing = {0: "no pause", 1: "one pause"}.get(pauses, f"{pauses} pauses")
    return Finding(
        "stations-moving",
        "warning",
        f"{standing} of the robot with images: {stations} of {total} frames along its way are the"
        " stations, with the time between images and poses as an unknown",
        "let the robot stand still for a second at every station: blur by motion and a shutter that"
        " reads row by row are not modelled",
    )


def pauses_without_image(empty: int, total: int) -> Finding:
    """Some pauses are no station."""
    return Finding(
        "pauses-without-image",
        "warning",
        f"{empty} of {total} pauses have no image",
        "let the robot stand still longer than the time between two images",
    )
