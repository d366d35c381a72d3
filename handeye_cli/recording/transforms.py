"""The tree of frames, by the rules of ROS's tf2.

Names lose one leading slash; transforms of a frame to itself, without a name, with numbers that are
not finite or beyond all lengths, or with a quaternion far from unit length are dropped; a static
transform holds for all time and its last value counts; between two samples the translation is
interpolated linearly and the rotation along the shorter arc; nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise, product

import numpy as np
from numpy.typing import NDArray

from handeye_cli.errors import InputError, did_you_mean
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.trajectory import between
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.layout import LARGEST
from handeye_cli.records import FloatArray, IntArray

BoolArray = NDArray[np.bool_]
Way = tuple[str, ...]
"""Frames, each of which has the next one as a parent."""

_MOST_WAYS = 64
"""Ways up from a frame that are looked at; a tree has one."""
_UNIT_TOLERANCE = 0.01
"""Largest deviation of a quaternion's squared length from 1, tf2's own limit."""
_MOVING_TRANSLATION = 1e-3
_MOVING_ROTATION = 1e-3
"""A link whose pose stays within these (metres, radians) of its first one does not move."""


@dataclass(frozen=True)
class Samples:
    """Recorded poses `parent_T_child` of one pair of frames, in any order.

    Attributes:
        parent: Name of the parent frame.
        child: Name of the child frame.
        static: Whether they came as static transforms.
        stamps_ns: (n,) times in the messages' headers.
        log_times_ns: (n,) times of recording.
        numbers: (n, 7) translation and quaternion x y z w.
    """

    parent: str
    child: str
    static: bool
    stamps_ns: IntArray
    log_times_ns: IntArray
    numbers: FloatArray

    def times_ns(self, clock: Clock) -> IntArray:
        """Return the (n,) times by one of the clocks."""
        return self.stamps_ns if clock is Clock.STAMP else self.log_times_ns

    @property
    def moves(self) -> bool:
        """Whether the child really moves in the parent."""
        ways = self.numbers[:, :3] - self.numbers[:1, :3]
        if np.any(np.linalg.norm(ways, axis=1) > _MOVING_TRANSLATION):
            return True
        rotated = _poses(self.numbers)[:, :3, :3]
        turns = rotations.angle(rotated @ rotated[0].T)
        return bool(np.any(turns > _MOVING_ROTATION))


def clean(samples: Samples) -> Samples:
    """Return the samples tf2 would accept; none of a link without two different names."""
    usable = np.abs(samples.numbers) <= LARGEST  # not where a number is none
    square = np.sum(np.where(usable, samples.numbers, 0.0)[:, 3:] ** 2, axis=1)
    good = usable.all(axis=1) & (np.abs(square - 1.0) <= _UNIT_TOLERANCE)
    good &= bool(samples.parent and samples.child and samples.parent != samples.child)
    return replace(
        samples,
        stamps_ns=samples.stamps_ns[good],
        log_times_ns=samples.log_times_ns[good],
        numbers=samples.numbers[good],
    )


def plain_name(frame: str) -> str:
    """Return a frame's name without a leading slash, which ROS 1 put there."""
    return frame.removeprefix("/")


def interpolate(samples: Samples, clock: Clock, times_ns: IntArray) -> tuple[FloatArray, BoolArray]:
    """Return the poses at some times, and where they are known.

    Args:
        samples: At least one sample. Of several with the same time the first counts.
        clock: Which of their times is meant.
        times_ns: (m,) times.

    Returns:
        (m, 4, 4) `parent_T_child`, and (m,) whether the time lies within the samples' own.
    """
    if samples.static:
        last = _poses(samples.numbers[-1])
        return np.broadcast_to(last, (len(times_ns), 4, 4)), np.ones(len(times_ns), dtype=bool)
    known_ns, first = np.unique(samples.times_ns(clock), return_index=True)
    poses = _poses(samples.numbers[first])
    before = np.clip(np.searchsorted(known_ns, times_ns, side="right") - 1, 0, len(known_ns) - 1)
    after = np.minimum(before + 1, len(known_ns) - 1)
    span = np.maximum(known_ns[after] - known_ns[before], 1)
    weight = np.clip((times_ns - known_ns[before]) / span, 0.0, 1.0)
    valid = (times_ns >= known_ns[0]) & (times_ns <= known_ns[-1])
    found, inside = poses[before], np.flatnonzero(weight)  # most times are those of samples
    found[inside] = between(found[inside], poses[after[inside]], weight[inside])
    return found, valid


@dataclass(frozen=True)
class Chain:
    """The links between two frames of a tree, from their nearest common ancestor down to each.

    Attributes:
        base: Name of the frame the poses are in.
        gripper: Name of the frame they are of.
        to_base: Links from the common ancestor down to the base.
        to_gripper: Links from the common ancestor down to the gripper.
    """

    base: str
    gripper: str
    to_base: tuple[Samples, ...]
    to_gripper: tuple[Samples, ...]

    @property
    def dynamic(self) -> tuple[Samples, ...]:
        """Its links that are not static."""
        return tuple(link for link in (*self.to_base, *self.to_gripper) if not link.static)

    def sample_times_ns(self, clock: Clock) -> IntArray:
        """Return the (n,) sorted times at which one of its links was recorded."""
        times = [link.times_ns(clock) for link in self.dynamic]
        return np.unique(np.concatenate(times)) if times else np.empty(0, dtype=np.int64)

    def at(self, times_ns: IntArray, clock: Clock) -> tuple[FloatArray, BoolArray]:
        """Return (m, 4, 4) `base_T_gripper` at (m,) times, and (m,) where it is known."""
        ancestor_T_base, base_known = _product(self.to_base, times_ns, clock)
        ancestor_T_gripper, gripper_known = _product(self.to_gripper, times_ns, clock)
        return se3.inverse(ancestor_T_base) @ ancestor_T_gripper, base_known & gripper_known


class TransformTree:
    """Frames and the links between them.

    Args:
        samples: Cleaned samples, each pair of frames at most once as static and once as dynamic.
    """

    def __init__(self, samples: Iterable[Samples]) -> None:
        links: dict[str, dict[str, Samples]] = {}
        for each in samples:
            if len(each.numbers):
                of_child = links.setdefault(each.child, {})
                of_child[each.parent] = _latest(of_child.get(each.parent), each)
        self._links: Mapping[str, Mapping[str, Samples]] = links
        self._parent = {child: next(iter(parents)) for child, parents in links.items()}

    @property
    def frames(self) -> list[str]:
        """Names of all frames, sorted."""
        return sorted(self._links.keys() | set(self._parent.values()))

    def require(self, frame: str, flag: str) -> str:
        """Return the name of a frame without a leading slash.

        Raises:
            InputError: The tree has no such frame.
        """
        name = plain_name(frame)
        if name not in self.frames:
            near = did_you_mean(name, self.frames)
            known = ", ".join(self.frames) or "none"
            raise InputError(
                f"expected a frame of the recording, found {frame!r}; it has: {known}",
                where=flag,
                hint=f"did you mean {near!r}?" if near else None,
            )
        return name

    def ancestors(self, frame: str) -> list[str]:
        """Return a frame and the frames above it, ending with the root.

        Raises:
            InputError: The frames form a loop.
        """
        path = [frame]
        while (above := self._parent.get(path[-1])) is not None:
            if above in path:
                loop = " -> ".join([*path[path.index(above) :], above])
                raise InputError(f"expected the frames to form a tree, found the loop {loop}")
            path.append(above)
        return path

    def root(self, frame: str) -> str:
        """Return the frame at the top of a frame's tree."""
        return self.ancestors(frame)[-1]

    def leaves(self, counts: Callable[[str], bool], *, moving: bool) -> list[str]:
        """Return the children of dynamic links that have no such child below them, sorted.

        Args:
            counts: Whether a frame is considered at all.
            moving: Count a dynamic link only when its pose really changes.
        """
        ends = {
            child
            for child in self._links
            if counts(child) and self._is_dynamic(child, moving=moving)
        }
        inner = {above for end in ends for way in self._ways(end) for above in way[1:]}
        return sorted(ends - inner)

    def is_below(self, frame: str, base: str) -> bool:
        """Return whether one of the ways up from a frame leads to another one."""
        return frame != base and any(base in way for way in self._ways(frame))

    def chain(self, base: str, gripper: str, *, named: bool = False) -> Chain:
        """Return the links between two frames.

        Args:
            base: Where it begins.
            gripper: Where it ends.
            named: Whether both frames are what the user wants. Then a frame between them may have
                several parents, if one alone leads from the one to the other.

        Raises:
            InputError: They are not in one tree, or a frame between them has several parents.
        """
        joints = self._joints(base, gripper) if named else set()
        if len(joints) == 1:
            return self._joined(base, gripper, joints.pop())
        above_base, above_gripper = self.ancestors(base), self.ancestors(gripper)
        common = _first_common(above_gripper, above_base)
        if common is None:
            raise InputError(
                f"expected {base!r} and {gripper!r} in one tree of frames, found their roots"
                f" {above_base[-1]!r} and {above_gripper[-1]!r}",
                hint="choose others with --base-frame and --gripper-frame",
            )
        joint = _up_to(common, above_base), _up_to(common, above_gripper)
        for child in (*joint[0][:-1], *joint[1][:-1]):
            self._require_one_parent(child)
        return self._joined(base, gripper, joint)

    def _joined(self, base: str, gripper: str, joint: tuple[Way, Way]) -> Chain:
        return Chain(base, gripper, *(self._links_down(way) for way in joint))

    def _ways(self, frame: str) -> Iterator[Way]:
        """Return the ways from a frame to the top, as many as are looked at."""
        return islice(self._ways_up((frame,)), _MOST_WAYS)

    def _ways_up(self, path: Way) -> Iterator[Way]:
        """Yield the ways from the end of a path to the top, whichever parents they take."""
        parents = [each for each in self._links.get(path[-1], ()) if each not in path]
        if not parents:
            yield path
        for parent in parents:
            yield from self._ways_up((*path, parent))

    def _joints(self, base: str, gripper: str) -> set[tuple[Way, Way]]:
        """Return the ways up from two frames to where they meet."""
        ways = product(self._ways(base), self._ways(gripper))
        met = ((way, other, _first_common(other, way)) for way, other in ways)
        return {
            (_up_to(common, way), _up_to(common, other))
            for way, other, common in met
            if common is not None
        }

    def _is_dynamic(self, child: str, *, moving: bool) -> bool:
        link = self._links[child][self._parent[child]]
        return not link.static and (link.moves or not moving)

    def _links_down(self, way: Way) -> tuple[Samples, ...]:
        """Return the links along a way up, from its top downwards."""
        upwards = [self._links[child][parent] for child, parent in pairwise(way)]
        return tuple(reversed(upwards))

    def _require_one_parent(self, child: str) -> None:
        parents = self._links[child]
        if len(parents) > 1:
            raise InputError(
                f"expected one parent of the frame {child!r}, found {', '.join(sorted(parents))}",
                hint="two nodes tell where it is: `ros2 topic info -v /tf` lists them; stop one of"
                " them, or name the frames with --base-frame and --gripper-frame, between which"
                " one alone must lead",
            )


def _first_common(way: Sequence[str], other: Sequence[str]) -> str | None:
    return next((frame for frame in way if frame in other), None)


def _up_to(frame: str, way: Sequence[str]) -> Way:
    """Return the part of a way that ends with a frame."""
    return tuple(way[: way.index(frame) + 1])


def _latest(known: Samples | None, new: Samples) -> Samples:
    """Of static and dynamic samples of one link, the kind that was recorded last counts."""
    if known is None or new.log_times_ns.max() >= known.log_times_ns.max():
        return new
    return known


def _poses(numbers: FloatArray) -> FloatArray:
    return se3.from_parts(rotations.matrix_from_quaternion(numbers[..., 3:]), numbers[..., :3])


def _product(
    links: Iterable[Samples], times_ns: IntArray, clock: Clock
) -> tuple[FloatArray, BoolArray]:
    poses = np.broadcast_to(np.eye(4), (len(times_ns), 4, 4))
    known = np.ones(len(times_ns), dtype=bool)
    for link in links:
        of_link, link_known = interpolate(link, clock, times_ns)
        poses, known = poses @ of_link, known & link_known
    return poses, known
