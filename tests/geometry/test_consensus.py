"""The choice among candidate rotations on random scenes with turned, mirrored and wrong plates."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import consensus

QUARTERS = Rotation.from_rotvec(np.arange(4)[:, None] * [0.0, 0.0, np.pi / 2]).as_matrix()


def random_rotations(count: int, rng: np.random.Generator) -> np.ndarray:
    return Rotation.from_quat(rng.normal(size=(count, 4))).as_matrix()


class Scene:
    """Stations whose true candidate is known: column `truth[i]` of shuffled candidates."""

    def __init__(self, count: int, seed: int, *, flips=None, noise=2e-3, turns=None):
        """`flips`: spread of the lines of sight in radians; None leaves the mirror images out."""
        self.rng = rng = np.random.default_rng(seed)
        R_X, R_Z = random_rotations(2, rng)
        turns = rng.normal(scale=0.5, size=(count, 3)) if turns is None else turns
        self.robot = Rotation.from_rotvec(turns).as_matrix() @ random_rotations(1, rng)[0]
        seen = np.swapaxes(self.robot @ R_X, -1, -2) @ R_Z
        noisy = Rotation.from_rotvec(noise * rng.normal(size=(count, 3))).as_matrix() @ seen
        candidates = noisy[:, None] @ QUARTERS
        if flips is not None:
            candidates = np.concatenate([candidates, self._mirrored(candidates, flips)], axis=1)
        kinds = candidates.shape[1]
        self.kind = np.array([rng.permutation(kinds) for _ in range(count)])
        self.candidates = np.take_along_axis(candidates, self.kind[..., None, None], axis=1)
        self.penalties = np.zeros((count, kinds))

    def _mirrored(self, candidates: np.ndarray, spread: float) -> np.ndarray:
        """The other optimum of weak perspective: mirrored along a line of sight near z."""
        sight = self.rng.normal(scale=spread, size=(len(candidates), 3))
        sight[:, 2] += 1.0
        sight /= np.linalg.norm(sight, axis=1, keepdims=True)
        mirror = np.eye(3) - 2.0 * sight[:, :, None] * sight[:, None, :]
        return mirror[:, None] @ candidates * np.array([1.0, 1.0, -1.0])

    def choose(self) -> consensus.Choice:
        return consensus.choose(self.robot, self.candidates, self.penalties)

    def chosen_kinds(self) -> np.ndarray:
        """0 to 3: the true pose after so many quarter turns; 4 to 7: its mirror image."""
        index = self.choose().index
        return self.kind[np.arange(len(index)), index]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("count", [3, 5, 12, 60])
def test_quarter_turns_are_chosen_alike(count, seed):
    kinds = Scene(count, seed).chosen_kinds()
    assert len(set(kinds.tolist())) == 1


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [4, 9])
def test_mirror_images_are_turned_down(count, seed):
    scene = Scene(count, seed, flips=0.1)
    kinds = scene.chosen_kinds()
    assert set(kinds.tolist()) <= {0, 1, 2, 3}
    assert len(set(kinds.tolist())) == 1


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("penalty", [0.0, 3.0, 30.0])
def test_a_long_lens_leaves_the_decision_to_the_images(penalty, seed):
    """Seen along parallel lines, all plates may be mirrored and R_X turned by pi about them."""
    scene = Scene(6, seed, flips=0.0, noise=0.0)
    scene.penalties = np.where(scene.kind < 4, 0.0, penalty)
    choice = scene.choose()
    kinds = set(scene.kind[np.arange(6), choice.index].tolist())
    assert len(kinds) == 1
    assert kinds <= ({0, 1, 2, 3} if penalty else set(range(8)))
    assert choice.margin == pytest.approx(6 * penalty, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_different_lines_of_sight_leave_a_wide_margin(seed):
    # A mirrored view misses by twice the spread of the lines, 0.1 rad, at a noise of 2e-3 rad.
    assert Scene(9, seed, flips=0.1).choose().margin > 100.0


@pytest.mark.parametrize("seed", range(3))
def test_penalties_that_favour_the_wrong_candidate_are_outvoted(seed):
    scene = Scene(8, seed, flips=0.1)
    scene.penalties = np.where(scene.kind < 4, scene.rng.uniform(0.0, 8.0, scene.kind.shape), 0.0)
    kinds = scene.chosen_kinds()
    assert set(kinds.tolist()) <= {0, 1, 2, 3}
    assert len(set(kinds.tolist())) == 1


def agree_but_for(wrong: int, kinds: np.ndarray) -> bool:
    return len(set(np.delete(kinds, wrong).tolist())) == 1


@pytest.mark.parametrize("seed", range(5))
def test_one_plate_seen_wrong_does_not_decide_for_the_rest(seed):
    scene = Scene(8, seed)
    wrong = int(scene.rng.integers(8))
    scene.candidates[wrong] = random_rotations(1, scene.rng)[0] @ scene.candidates[wrong]
    assert agree_but_for(wrong, scene.chosen_kinds())


@pytest.mark.parametrize("seed", range(5))
def test_one_robot_pose_half_a_radian_off_does_not_decide_for_the_rest(seed):
    scene = Scene(8, seed)
    wrong = int(scene.rng.integers(8))
    slip = Rotation.from_rotvec([0.3, -0.4, 0.0]).as_matrix()
    scene.robot[wrong] = slip @ scene.robot[wrong]
    assert agree_but_for(wrong, scene.chosen_kinds())


def test_one_gross_robot_pose_does_not_decide_for_the_rest():
    agreed = []
    for seed in range(10):
        scene = Scene(8, seed)
        wrong = int(scene.rng.integers(8))
        scene.robot[wrong] = random_rotations(1, scene.rng)[0]
        agreed.append(agree_but_for(wrong, scene.chosen_kinds()))
    assert all(agreed)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 2e-2])
def test_noise_from_none_to_a_degree(noise):
    kinds = Scene(10, 20, noise=noise).chosen_kinds()
    assert len(set(kinds.tolist())) == 1


def best_penalties(scene: Scene) -> np.ndarray:
    scene.penalties = scene.rng.uniform(0.0, 20.0, scene.kind.shape)
    scene.penalties -= scene.penalties.min(axis=1, keepdims=True)
    return np.argmin(scene.penalties, axis=1)


@pytest.mark.parametrize(
    "turns",
    [
        np.zeros((6, 3)),
        np.linspace(-1.0, 1.0, 6)[:, None] * [0.0, 0.6, 0.8],
        1e-3 * np.random.default_rng(1).normal(size=(6, 3)),
    ],
    ids=["standing still", "one axis", "hardly turning"],
)
def test_without_two_axes_the_best_fit_is_taken(turns):
    scene = Scene(6, 30, turns=turns, noise=0.0)
    expected = best_penalties(scene)
    choice = scene.choose()
    assert np.array_equal(choice.index, expected)
    assert choice.margin == np.inf


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_stations_take_the_best_fit(count):
    scene = Scene(count, 31)
    expected = best_penalties(scene)
    choice = scene.choose()
    assert np.array_equal(choice.index, expected)
    assert choice.margin == np.inf


def test_a_single_candidate_is_taken():
    scene = Scene(5, 32)
    alone = scene.candidates[:, :1]
    choice = consensus.choose(scene.robot, alone, np.zeros((5, 1)))
    assert np.array_equal(choice.index, np.zeros(5))
    assert choice.margin == np.inf


@pytest.mark.parametrize("seed", range(3))
def test_candidates_that_do_not_exist_are_never_chosen(seed):
    scene = Scene(8, seed, flips=0.1)
    gone = scene.rng.random(scene.kind.shape) < 0.5
    gone &= scene.kind != 1
    scene.penalties[gone] = np.inf
    choice = scene.choose().index
    assert not np.any(gone[np.arange(8), choice])
    assert np.array_equal(scene.kind[np.arange(8), choice], np.ones(8))


def test_one_candidate_each_is_all_there_is():
    scene = Scene(6, 33)
    scene.penalties[scene.kind != 2] = np.inf
    choice = scene.choose().index
    assert np.array_equal(scene.kind[np.arange(6), choice], np.full(6, 2))
