"""The `recording:` mapping of an inspection: what a robot's recording holds."""

from __future__ import annotations

from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.place import Place
from handeye_cli.records.recording_summary import (
    LinkSummary,
    MissingFlag,
    Motion,
    PauseSummary,
    RecordingSummary,
    TopicSummary,
    UsedParts,
)


def summary_from_data(data: dict[str, Any] | None, place: Place) -> RecordingSummary | None:
    """Return the summary of a `recording:` mapping, or None without one.

    Raises:
        InputError: The covariance of its camera is none.
    """
    if data is None:
        return None
    return RecordingSummary(
        duration=float(data["duration_s"]),
        cut=data["cut"],
        topics=tuple(_topic(item) for item in data["topics"]),
        links=tuple(_link(item) for item in data["links"]),
        pauses=tuple(_pause(item) for item in data["pauses"]),
        ready=data["ready"],
        used=_used(data["used"], place.key("recording").key("used")),
        missing=tuple(
            MissingFlag(item["flag"], tuple(item.get("choices", ())))
            for item in data.get("missing", [])
        ),
        command=data["command"],
    )


def data_from_summary(summary: RecordingSummary | None) -> dict[str, Any] | None:
    """Return a summary as a `recording:` mapping."""
    if summary is None:
        return None
    return parts.without_unknown(
        {
            "duration_s": summary.duration,
            "cut": summary.cut,
            "topics": [_data_from_topic(each) for each in summary.topics],
            "links": [_data_from_link(each) for each in summary.links],
            "pauses": [_data_from_pause(each) for each in summary.pauses],
            "ready": summary.ready,
            "used": _data_from_used(summary.used),
            "missing": [_data_from_missing(each) for each in summary.missing] or None,
            "command": summary.command,
        }
    )


def _topic(item: dict[str, Any]) -> TopicSummary:
    return TopicSummary(
        name=str(item["name"]),
        schema=item["schema"],
        encoding=item["encoding"],
        count=item["count"],
        rate=float(item["rate_hz"]) if "rate_hz" in item else None,
        role=item.get("role", ""),
    )


def _data_from_topic(topic: TopicSummary) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "name": topic.name,
            "schema": topic.schema,
            "encoding": topic.encoding,
            "count": topic.count,
            "rate_hz": topic.rate,
            "role": topic.role or None,
        }
    )


def _link(item: dict[str, Any]) -> LinkSummary:
    return LinkSummary(item["parent"], item["child"], Motion(item["motion"]), item["count"])


def _data_from_link(link: LinkSummary) -> dict[str, Any]:
    return {
        "parent": link.parent,
        "child": link.child,
        "motion": str(link.motion),
        "count": link.count,
    }


def _pause(item: dict[str, Any]) -> PauseSummary:
    return PauseSummary(float(item["start_s"]), float(item["duration_s"]), item["images"])


def _data_from_pause(pause: PauseSummary) -> dict[str, Any]:
    return {"start_s": pause.start, "duration_s": pause.duration, "images": pause.images}


def _used(data: dict[str, Any], place: Place) -> UsedParts:
    return UsedParts(
        image_topic=data.get("image_topic"),
        camera_info_topic=data.get("camera_info_topic"),
        camera=parts.camera_from_data(data.get("camera"), place),
        camera_file=data.get("camera_file"),
        pose_topic=data.get("pose_topic"),
        frames=tuple(data.get("frames", ())),
        clock=data.get("clock"),
    )


def _data_from_used(used: UsedParts) -> dict[str, Any]:
    return parts.without_unknown(
        {
            "image_topic": used.image_topic,
            "camera_info_topic": used.camera_info_topic,
            "camera": parts.data_from_camera(used.camera),
            "camera_file": used.camera_file,
            "pose_topic": used.pose_topic,
            "frames": list(used.frames) or None,
            "clock": used.clock,
        }
    )


def _data_from_missing(each: MissingFlag) -> dict[str, Any]:
    return parts.without_unknown({"flag": each.flag, "choices": list(each.choices) or None})
