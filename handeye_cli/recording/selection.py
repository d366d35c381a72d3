"""Finding in a recording what is unique, and asking for a flag where it is not."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from handeye_cli.conventions import MM
from handeye_cli.errors import InputError, UsageError, did_you_mean
from handeye_cli.recording import conflicts, message_table, pixels
from handeye_cli.recording.container import Channel
from handeye_cli.recording.messages import Role
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.survey import ImageFrames, Survey
from handeye_cli.recording.transforms import Chain, TransformTree

_LISTED = 12
"""At most this many channels are named in a message."""
_TRANSPORTS = ("compressed",)
"""Last parts of image topics that name a way of transport, not a camera."""


class AmbiguousError(InputError):
    """Several things of a recording could be meant.

    Args:
        what: What is looked for.
        choices: What it may be.
        flag: What chooses.
    """

    def __init__(self, what: str, choices: tuple[str, ...], flag: str) -> None:
        listed = ", ".join(choices) or "none"
        example = f", as with {shlex.join([flag, choices[0]])}" if choices else f" with {flag}"
        super().__init__(
            f"expected one {what}, found {len(choices)}: {listed}", hint=f"choose one{example}"
        )
        self.choices = choices
        self.flag = flag


def images(survey: Survey, wanted: str | None) -> ImageFrames:
    """Return the images to use: the topic asked for, or the only one with pictures.

    Raises:
        InputError: There is none, several, or not the one asked for; or it holds no pictures.
    """
    topics = sorted(survey.images)
    if wanted is None:
        usable = [t for t in topics if pixels.refusal(survey.images[t].first, t) is None]
        topics = usable or topics
    _require_read(survey, Role.IMAGE, topics, wanted)
    if not topics:
        hint = "record sensor_msgs or Foxglove images, raw or compressed"
        raise _missing("an image topic", survey, hint)
    frames = survey.images[_choose("image topic", topics, wanted, "--image-topic")]
    reason = pixels.refusal(frames.first, frames.topic)
    if reason:
        raise pixels.refused(reason, f"{survey.path}, {frames.topic}")
    return frames


def camera_info_topic(survey: Survey, frames: ImageFrames, wanted: str | None) -> str | None:
    """Return the topic of the intrinsics that belong to the images, or None when there is none.

    Without being told it is the sibling `camera_info` of the image topic; failing that, the only
    one in the images' frame; failing that, the only one beside the only image topic.

    Raises:
        InputError: Several could be meant, or the one asked for is not there.
    """
    topics = sorted(survey.camera_infos)
    sibling = "/".join([*camera_parts(frames.topic)[:-1], "camera_info"])
    if wanted is None and sibling in topics:
        return sibling
    if wanted is None:
        topics = _in_frame(survey, frames.frame_id) or (topics if len(survey.images) == 1 else [])
        if not topics:
            return None
    return _choose("topic with intrinsics", topics, wanted, "--camera-info-topic")


def camera_parts(topic: str) -> list[str]:
    """Return the parts of an image topic's name without those that name a transport."""
    parts = topic.split("/")
    return parts[:-1] if parts[-1] in _TRANSPORTS else parts


def robot_chain(survey: Survey, camera_frame: str, options: McapOptions) -> Chain:
    """Return the links that lead from the robot's base to its gripper.

    A pose topic is used when it is asked for, or when it is the only one and no frame of TF moves.
    In TF, without being told:

    - The gripper is the leaf of the dynamic links: the last frame that is not fixed to the one
      above it. Frames that static transforms attach below it, such as a tool or the camera, are
      rigidly connected to it, so any of them would do as well; this one always exists. If there are
      several leaves, the links that are published but never move are passed over, such as the
      fingers of a hand.
    - What hangs below the camera's own frame is no part of the robot: markers it detects.
    - The base is the root of the gripper's tree.

    Args:
        survey: The recording.
        camera_frame: The images' frame.
        options: Choices that go before these rules.

    Raises:
        InputError: There is nothing to choose, or too much.
        UsageError: A pose topic and frames of TF are both asked for.
    """
    asked_frames = options.base_frame is not None or options.gripper_frame is not None
    if options.pose_topic is not None and asked_frames:
        raise UsageError(
            "expected --pose-topic or frames of TF, found both",
            hint="leave out --pose-topic, or --base-frame and --gripper-frame",
        )
    tree = TransformTree(survey.links)
    dynamic = any(not link.static for link in survey.links)
    if options.pose_topic is not None or (survey.poses and not dynamic and not asked_frames):
        return _believed(_pose_chain(survey, options.pose_topic))
    if not dynamic:
        _require_read(survey, Role.POSE, [], None)
        raise _missing(
            "a moving frame in /tf or a topic with stamped poses",
            survey,
            "record /tf and /tf_static, a geometry_msgs/msg/PoseStamped of the gripper, or"
            " /joint_states and /robot_description",
        )
    return _believed(_frame_chain(tree, camera_frame, options))


def _believed(chain: Chain) -> Chain:
    """Return a chain of links none of which is at two places at a time.

    Raises:
        InputError: One is.
    """
    for link in chain.dynamic:
        count, far = conflicts.jumps(link)
        if count:
            raise InputError(
                f"expected one pose of {link.child!r} in {link.parent!r} at a time, found that it"
                f" jumps to and fro {count} times among {len(link.numbers)} poses, typically by"
                f" {far / MM:.1f} mm",
                hint="two nodes tell it, or the clock was set back: `ros2 topic info -v /tf` lists"
                " the nodes; stop one of them, or choose frames that only one tells with"
                " --base-frame and --gripper-frame",
            )
    return chain


def _pose_chain(survey: Survey, wanted: str | None) -> Chain:
    topics = sorted(survey.poses)
    _require_read(survey, Role.POSE, topics, wanted)
    if not topics:
        raise _missing("a topic with stamped poses", survey, "use /tf by leaving out --pose-topic")
    topic = _choose("pose topic", topics, wanted, "--pose-topic")
    samples = survey.poses[topic]
    if len(samples) > 1:
        found = ", ".join(f"{each.child!r} in {each.parent!r}" for each in samples)
        raise InputError(f"expected poses of one frame in one, found {found}", where=topic)
    return Chain(samples[0].parent, samples[0].child, to_base=(), to_gripper=samples)


def _frame_chain(tree: TransformTree, camera_frame: str, options: McapOptions) -> Chain:
    base = options.base_frame and tree.require(options.base_frame, "--base-frame")
    if options.gripper_frame is not None:
        gripper = tree.require(options.gripper_frame, "--gripper-frame")
    else:
        gripper = _gripper(tree, camera_frame, base)
    chain = tree.chain(base or tree.root(gripper), gripper, named=bool(base))
    if not chain.dynamic:
        raise InputError(
            f"expected a gripper that moves in its base, found {gripper!r} fixed to {chain.base!r}",
            hint="choose others with --base-frame and --gripper-frame",
        )
    return chain


def _gripper(tree: TransformTree, camera_frame: str, base: str | None) -> str:
    def of_robot(frame: str) -> bool:
        above = tree.ancestors(frame)
        return camera_frame not in above and (base is None or tree.is_below(frame, base))

    leaves = tree.leaves(of_robot, moving=False)
    if len(leaves) > 1:
        leaves = tree.leaves(of_robot, moving=True) or leaves
    if not leaves:
        raise InputError(
            f"expected a frame that moves {f'below {base!r}' if base else 'in /tf'}, found none",
            hint="choose frames with --base-frame and --gripper-frame, of: "
            + ", ".join(tree.frames),
        )
    return _choose("moving frame", leaves, None, "--gripper-frame")


def _in_frame(survey: Survey, frame_id: str) -> list[str]:
    return sorted(
        topic
        for topic, infos in survey.camera_infos.items()
        if frame_id and infos[0].header.frame_id.removeprefix("/") == frame_id
    )


def _choose(what: str, choices: Sequence[str], wanted: str | None, flag: str) -> str:
    listed = ", ".join(choices) or "none"
    if wanted is None:
        if len(choices) == 1:
            return choices[0]
        raise AmbiguousError(what, tuple(choices), flag)
    if wanted in choices:
        return wanted
    near = did_you_mean(wanted, list(choices))
    raise InputError(
        f"expected one of the recording's choices for {what}, found {wanted!r}; it has: {listed}",
        where=flag,
        hint=f"did you mean {near!r}?" if near else None,
    )


def _require_read(survey: Survey, role: Role, topics: Sequence[str], wanted: str | None) -> None:
    """Refuse messages by name that are asked for, or are all there is, and cannot be read."""
    if wanted in topics or (wanted is None and topics):
        return
    for channel in survey.channels:
        refusal = message_table.refusal_of(channel.schema_name)
        if refusal and refusal.role is role and wanted in (None, channel.topic):
            raise InputError(
                f"expected messages that can be read, found {refusal.what}: {_describe(channel)}",
                where=survey.path,
                hint=refusal.advice,
            )


def _missing(what: str, survey: Survey, hint: str) -> InputError:
    names = [_describe(channel, silent=survey.is_silent(channel)) for channel in survey.channels]
    listed = ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
    cut = ", and its end is cut off" if survey.cut else ""
    return InputError(
        f"expected {what}, found {listed or 'no channels at all'}{cut}",
        where=survey.path,
        hint=hint,
    )


def _describe(channel: Channel, *, silent: bool = False) -> str:
    form = f"{channel.schema_name or 'no schema'} as {channel.message_encoding}"
    return f"{channel.topic} ({form}{', without a message' if silent else ''})"
