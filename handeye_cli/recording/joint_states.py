"""Forward kinematics: from the values of a robot's joints to the transforms of its links.

The result is what `robot_state_publisher` would have sent on /tf and /tf_static, and is used in the
same way.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye_cli.geometry import rotations
from handeye_cli.recording.layout import LARGEST
from handeye_cli.recording.messages import JointsMessage
from handeye_cli.recording.transforms import Samples, clean
from handeye_cli.recording.urdf import Joint
from handeye_cli.records import FloatArray, IntArray


@dataclass
class JointValues:
    """Values of one joint, as they were recorded."""

    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    log_times_ns: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))


class JointRecord:
    """The values of all joints, by their names."""

    def __init__(self) -> None:
        self.joints: dict[str, JointValues] = {}

    def add(self, log_time_ns: int, message: JointsMessage) -> None:
        """Take in the state of some joints."""
        for name, value in message.positions:
            joint = self.joints.setdefault(name, JointValues())
            joint.stamps_ns.append(message.header.stamp_ns)
            joint.log_times_ns.append(log_time_ns)
            joint.values.append(value)


def with_joints(
    links: Sequence[Samples], joints: Iterable[Joint], record: JointRecord
) -> tuple[tuple[Samples, ...], int]:
    """Return links with those that follow from the joints, where nothing of TF moves.

    Args:
        links: The links of TF; these are kept where a joint would say the same.
        joints: The robot's joints.
        record: Their values.

    Returns:
        All links, and how many of them follow from the joints.
    """
    known = tuple(links)
    if not record.joints or any(link.moves for link in known if not link.static):
        return known, 0
    children = {link.child for link in known}
    by_name = {joint.name: joint for joint in joints}
    computed = [
        link
        for joint in by_name.values()
        if joint.child not in children
        for link in _link(joint, by_name, record.joints)
    ]
    return (*known, *computed), len(computed)


def _link(
    joint: Joint, joints: Mapping[str, Joint], known: Mapping[str, JointValues]
) -> list[Samples]:
    """Return the samples of the link below a joint; none when its value was not recorded."""
    if joint.fixed:
        now = np.zeros(1, dtype=np.int64)
        return [_samples(joint, now, now, np.zeros(1))]
    leader, multiplier, offset = _leader(joint, joints)
    if leader not in known:
        return []
    recorded = known[leader]
    samples = _samples(
        joint,
        np.array(recorded.stamps_ns, dtype=np.int64),
        np.array(recorded.log_times_ns, dtype=np.int64),
        multiplier * np.array(recorded.values) + offset,
    )
    return [samples] if len(samples.numbers) else []


def _leader(joint: Joint, joints: Mapping[str, Joint]) -> tuple[str, float, float]:
    """Return the joint whose value counts, and the factor and offset from that value to ours."""
    multiplier, offset = 1.0, 0.0
    for _ in joints:
        if joint.mimic is None:
            break
        offset += multiplier * joint.mimic.offset
        multiplier *= joint.mimic.multiplier
        if joint.mimic.joint not in joints:
            return joint.mimic.joint, multiplier, offset
        joint = joints[joint.mimic.joint]
    return joint.name, multiplier, offset


def _samples(
    joint: Joint, stamps_ns: IntArray, log_times_ns: IntArray, values: FloatArray
) -> Samples:
    good = np.abs(values) <= LARGEST
    poses = joint.at(values[good])
    quaternions = rotations.quaternion_from_matrix(poses[:, :3, :3])
    numbers = np.concatenate([poses[:, :3, 3], quaternions], axis=1)
    return clean(
        Samples(
            joint.parent, joint.child, joint.fixed, stamps_ns[good], log_times_ns[good], numbers
        )
    )
