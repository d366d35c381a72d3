"""Interpolation and the tree of frames, against SciPy and by tf2's rules."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.transforms import Samples, TransformTree, clean, interpolate


def samples(parent, child, times, numbers, *, static=False):
    times = np.asarray(times, dtype=np.int64)
    numbers = np.asarray(numbers, dtype=float)
    return Samples(parent, child, static, times, times + 5, numbers)


def random_numbers(rng, count):
    turns = Rotation.from_quat(rng.normal(size=(count, 4)))
    return np.hstack([rng.normal(size=(count, 3)), turns.as_quat()])


def matrix(numbers):
    return se3.from_parts(Rotation.from_quat(numbers[3:]).as_matrix(), numbers[:3])


def link(parent, child, seed, *, static=False):
    rng = np.random.default_rng(seed)
    if static:
        return samples(parent, child, [0], random_numbers(rng, 1), static=True)
    return samples(parent, child, range(0, 1000, 10), random_numbers(rng, 100))


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_interpolation_equals_scipys(rng):
    times = np.sort(rng.choice(10**10, 50, replace=False)) + 1_700_000_000 * 10**9
    numbers = random_numbers(rng, 50)
    wanted = rng.integers(times[0], times[-1], 300, endpoint=True)
    shuffled = rng.permutation(50)
    poses, known = interpolate(
        samples("a", "b", times[shuffled], numbers[shuffled]), Clock.STAMP, wanted
    )
    seconds = (times - times[0]) / 1e9
    slerp = Slerp(seconds, Rotation.from_quat(numbers[:, 3:]))((wanted - times[0]) / 1e9)
    lerp = [np.interp((wanted - times[0]) / 1e9, seconds, numbers[:, i]) for i in range(3)]
    assert known.all()
    np.testing.assert_allclose(poses[:, :3, :3], slerp.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(poses[:, :3, 3], np.transpose(lerp), atol=1e-9)


def test_sign_of_a_quaternion_does_not_matter(rng):
    numbers = random_numbers(rng, 20)
    flipped = numbers.copy()
    flipped[::2, 3:] *= -1
    wanted = np.arange(0, 1900, 7)
    times = np.arange(20) * 100
    plain, _ = interpolate(samples("a", "b", times, numbers), Clock.STAMP, wanted)
    other, _ = interpolate(samples("a", "b", times, flipped), Clock.STAMP, wanted)
    np.testing.assert_allclose(plain, other, atol=1e-12)


def test_nothing_is_extrapolated_and_either_clock_can_be_asked(rng):
    moving = samples("a", "b", [100, 200], random_numbers(rng, 2))
    wanted = np.array([99, 100, 150, 200, 201, 205, 206])
    _, by_stamp = interpolate(moving, Clock.STAMP, wanted)
    _, by_log = interpolate(moving, Clock.LOG, wanted)
    assert by_stamp.tolist() == [False, True, True, True, False, False, False]
    assert by_log.tolist() == [False, False, True, True, True, True, False]


def test_single_sample_is_known_at_its_time_only(rng):
    numbers = random_numbers(rng, 1)
    poses, known = interpolate(
        samples("a", "b", [100], numbers), Clock.STAMP, np.array([99, 100, 101])
    )
    assert known.tolist() == [False, True, False]
    np.testing.assert_allclose(poses[1], matrix(numbers[0]), atol=1e-12)


def test_last_static_transform_holds_for_all_time(rng):
    numbers = random_numbers(rng, 2)
    poses, known = interpolate(
        samples("a", "b", [100, 200], numbers, static=True), Clock.STAMP, np.array([0, 10**15])
    )
    assert known.all()
    np.testing.assert_allclose(poses, [matrix(numbers[1])] * 2, atol=1e-12)


@pytest.mark.parametrize(
    "bad",
    [
        (0, 0, 0, 0, 0, 0, 0),
        (0, 0, 0, 0, 0, 0, 1.006),
        (0, 0, np.nan, 0, 0, 0, 1),
        (np.inf, 0, 0, 0, 0, 0, 1),
    ],
)
def test_bad_numbers_are_dropped(rng, bad):
    numbers = random_numbers(rng, 5)
    numbers[2] = bad
    good = clean(samples("a", "b", range(5), numbers))
    assert good.stamps_ns.tolist() == [0, 1, 3, 4]
    assert good.log_times_ns.tolist() == [5, 6, 8, 9]


def test_nearly_unit_quaternion_is_kept():
    assert len(clean(samples("a", "b", [0], [(0, 0, 0, 0, 0, 0, 1.004)])).numbers) == 1


@pytest.mark.parametrize(("parent", "child"), [("a", "a"), ("", "b"), ("a", "")])
def test_link_without_two_names_is_dropped(rng, parent, child):
    assert len(clean(samples(parent, child, range(3), random_numbers(rng, 3))).numbers) == 0


def test_chain_goes_through_the_nearest_common_ancestor():
    links = [
        link("world", "base", 1, static=True),
        link("base", "a1", 2),
        link("a1", "a2", 3),
        link("base", "b1", 4),
        link("b1", "b2", 5, static=True),
    ]
    chain = TransformTree(links).chain("b2", "a2")
    times = np.array([0, 333, 990])
    poses, known = chain.at(times, Clock.STAMP)
    assert known.all()
    assert [each.child for each in chain.dynamic] == ["b1", "a1", "a2"]
    edge = {each.child: interpolate(each, Clock.STAMP, times)[0] for each in links}
    base_T_b2 = edge["b1"] @ edge["b2"]
    expected = np.linalg.inv(base_T_b2) @ edge["a1"] @ edge["a2"]
    np.testing.assert_allclose(poses, expected, atol=1e-9)


@pytest.mark.parametrize(("parent", "base", "gripper"), [("b", "a", "c"), ("a", "b", "c")])
def test_chain_is_known_only_where_all_of_it_is(rng, parent, base, gripper):
    links = [
        samples("a", "b", [0, 100], random_numbers(rng, 2)),
        samples(parent, "c", [50, 150], random_numbers(rng, 2)),
    ]
    chain = TransformTree(links).chain(base, gripper)
    assert chain.sample_times_ns(Clock.STAMP).tolist() == [0, 50, 100, 150]
    _, known = chain.at(np.array([0, 50, 100, 150]), Clock.STAMP)
    assert known.tolist() == [False, True, True, False]


def test_chain_of_a_frame_to_itself_is_the_identity():
    poses, known = TransformTree([link("a", "b", 1)]).chain("b", "b").at(np.array([5]), Clock.LOG)
    np.testing.assert_array_equal(poses, np.eye(4)[None])
    assert known.all()


def test_separate_trees_are_refused_with_their_roots():
    tree = TransformTree([link("a", "b", 1), link("x", "y", 2)])
    with pytest.raises(InputError, match="their roots 'a' and 'x'"):
        tree.chain("b", "y")


def test_two_parents_are_refused_only_where_they_matter():
    tree = TransformTree([link("a", "b", 1), link("z", "b", 2), link("b", "c", 3)])
    assert len(tree.chain("b", "c").dynamic) == 1
    with pytest.raises(InputError, match="one parent of the frame 'b', found a, z"):
        tree.chain("a", "c")


@pytest.mark.parametrize("flip", [False, True])
def test_of_two_parents_the_one_that_leads_to_a_named_base_counts(flip):
    """A tool that the robot and a tracker both tell of, or a base that hangs in two worlds."""
    told = [link("arm", "tool", 2), link("tracker", "tool", 3)]
    tree = TransformTree([link("base", "arm", 1), *(told[::-1] if flip else told)])
    assert [each.parent for each in tree.chain("base", "tool", named=True).dynamic] == [
        "base",
        "arm",
    ]
    assert [each.parent for each in tree.chain("tracker", "tool", named=True).dynamic] == [
        "tracker"
    ]
    assert tree.is_below("tool", "base")
    assert tree.is_below("tool", "tracker")
    assert not tree.is_below("arm", "tracker")
    assert not tree.is_below("base", "base")
    if not flip:
        with pytest.raises(InputError, match="one parent of the frame 'tool', found arm, tracker"):
            tree.chain("base", "tool")


def test_a_named_base_that_two_parents_lead_to_is_refused():
    tree = TransformTree(
        [
            link("base", "arm", 1),
            link("arm", "tool", 2),
            link("base", "tracker", 3),
            link("tracker", "tool", 4),
        ]
    )
    with pytest.raises(InputError, match="one parent of the frame 'tool', found arm, tracker"):
        tree.chain("base", "tool", named=True)


def test_a_tangle_of_parents_is_refused_in_no_time():
    """Thirty frames with two parents each have a billion ways up."""
    tree = TransformTree(
        [link(f"{k}{side}", f"{k + 1}{to}", k) for k in range(30) for side in "ab" for to in "ab"]
    )
    with pytest.raises(InputError, match="one parent of the frame"):
        tree.chain("0a", "30a", named=True)


def test_a_link_told_both_ways_leads_to_a_named_base():
    tree = TransformTree([link("base", "arm", 1), link("arm", "base", 2), link("arm", "tool", 3)])
    assert len(tree.chain("base", "tool", named=True).dynamic) == 2


def test_loop_is_named():
    tree = TransformTree([link("a", "b", 1), link("b", "c", 2), link("c", "a", 3)])
    with pytest.raises(InputError, match="the loop c -> b -> a -> c"):
        tree.root("c")


@pytest.mark.parametrize("static_last", [True, False])
def test_link_sent_both_ways_is_of_the_kind_sent_last(rng, static_last):
    dynamic = samples("a", "b", [10, 20, 30], random_numbers(rng, 3))
    static = samples("a", "b", [40 if static_last else 0], random_numbers(rng, 1), static=True)
    for links in ([dynamic, static], [static, dynamic]):
        assert len(TransformTree(links).chain("a", "b").dynamic) == (0 if static_last else 1)


def test_leaves():
    still = samples("hand", "finger", range(3), [(0, 0, 0, 0, 0, 0, 1)] * 3)
    tree = TransformTree(
        [link("base", "arm", 1), link("arm", "hand", 2), link("hand", "cam", 3, static=True), still]
    )
    assert tree.leaves(lambda _: True, moving=False) == ["finger"]
    assert tree.leaves(lambda _: True, moving=True) == ["hand"]
    assert tree.leaves(lambda frame: frame != "finger", moving=False) == ["hand"]


def test_unknown_frame_is_named_with_the_nearest():
    tree = TransformTree([link("base_link", "tool0", 1)])
    assert tree.require("/tool0", "--gripper-frame") == "tool0"
    with pytest.raises(InputError, match="found 'tool'; it has: base_link, tool0") as caught:
        tree.require("tool", "--gripper-frame")
    assert caught.value.where == "--gripper-frame"
    assert "tool0" in caught.value.hint
