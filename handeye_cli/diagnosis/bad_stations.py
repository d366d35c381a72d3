"""Which stations of a recording contradict the others, and why."""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.masking import hides
from handeye_cli.diagnosis.moved_target import (
    likeliest_move,
    move_of,
    split_agreement,
    stands_out,
)
from handeye_cli.diagnosis.robust_fit import (
    MOST_FREEDOM,
    Agreement,
    best_agreement,
    cost,
    largest_contradiction,
    level,
    ordinary,
)
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.block_loop import BlockFit, BlockLoops, BoolArray
from handeye_cli.geometry.star import star_pairs
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.records import FloatArray, Noise, TargetSpec
from handeye_cli.records.bad_stations import (
    BadKind,
    BadStation,
    BadStations,
    TargetMove,
    WithoutBadStations,
    most_bad,
)
from handeye_cli.solvers import Problem, Solution, tsai_lenz

_SUSPICIOUS = 0.2
"""Chance of the most contradicted station, or of a move, above which nothing is looked for."""
_QUARTER = np.pi / 2.0
_NEAR_QUARTER = np.radians(3.0)
"""Difference from a quarter turn that is still called one: more is another mistake."""


def find_bad_stations(
    chain: Chain, given: Noise | None = None, target: TargetSpec | None = None
) -> BadStations:
    """Find stations whose image, robot pose or target contradict those of all others.

    Errors that all stations share (`Chain.by_causes`) count as noise of each of them here.

    Args:
        chain: The stations, in the order they were recorded; their motions determine an answer.
        given: Levels of the noise that are taken as given; the others are estimated from those
            stations that agree.
        target: What the target is, where that is known: images of one that looks the same after a
            turn may be exchanged and turned.

    Returns:
        The bad stations; nobody where there are fewer than four stations.
    """
    count = len(chain.A)
    if most_bad(count) == 0:
        return BadStations(count)
    solution, model = _rough(chain, given)
    loops = _loops(chain, model)
    everybody = ordinary(loops, _start(solution, model))
    hidden = hides(everybody)
    if not hidden and _all_well(everybody):
        return BadStations(count, scale=model.noise, noise_given=len(model.variances) == 0)
    best = _likelier(everybody, best_agreement(loops, model.variances, hidden=hidden))
    in_motion = chain.shared_error is not None and bool(np.any(chain.shared_error))
    agreed, cycles = _explained(best, target, hidden=hidden, in_motion=in_motion)
    moved = move_of(agreed) if len(agreed.found.Z) > 1 else None
    return BadStations(
        count=count,
        outliers=_outliers(agreed, {row for cycle in cycles for row in cycle}),
        exchanged=cycles,
        moved=moved,
        scale=_scale(chain, given, agreed, moved),
        noise_given=len(model.variances) == 0,
    )


def _explained(
    best: Agreement, target: TargetSpec | None, *, hidden: bool, in_motion: bool
) -> tuple[Agreement, tuple[tuple[int, ...], ...]]:
    """Return the agreement on one or on two places of the target, and who is exchanged with whom.

    Args:
        best: The largest agreement on one place.
        target: As in `find_bad_stations`.
        hidden: As in `best_agreement`.
        in_motion: Whether the robot was seen along its way, where errors change little from one
            station to the next.
    """
    from handeye_cli.diagnosis.mispaired import mispaired

    turns = _turns_of(target) if best.outside > 1 else None
    cycles = mispaired(best, turns)
    split = split_agreement(best, best.outside - sum(len(cycle) - 1 for cycle in cycles))
    if split is None or (in_motion and not stands_out(split)):
        return best, cycles
    from handeye_cli.diagnosis.other_lengths import instead_of_move

    resized = instead_of_move(split, best.loops, best.found.variances, hidden=hidden)
    agreed = split if resized is None else resized
    return agreed, mispaired(agreed, turns)


def agreement_on_two_places(chain: Chain, given: Noise | None = None) -> Agreement | None:
    """Return the stations that agree on a target that was moved once, if that explains them best.

    Args:
        chain: The stations, in the order they were recorded.
        given: Levels of the noise that are taken as given.

    Returns:
        The agreement with its two places, or None where one place, and bad stations, do as well.
    """
    if most_bad(len(chain.A)) == 0:
        return None
    _, model = _rough(chain, given)
    best = best_agreement(_loops(chain, model), model.variances, hidden=True)
    return split_agreement(best, best.outside)


def effect_of(
    left_out: tuple[str, ...], everybody: FloatArray, without: FloatArray
) -> WithoutBadStations:
    """Return how far leaving stations out moves the answer.

    Args:
        left_out: Names of the stations.
        everybody: (4, 4) mount_T_camera of all stations.
        without: (4, 4) mount_T_camera of the others.
    """
    step = se3.difference(without, everybody)
    return WithoutBadStations(
        left_out=left_out,
        rotation=float(np.linalg.norm(step[3:])),
        translation=float(np.linalg.norm(step[:3])),
    )


def _turns_of(target: TargetSpec | None) -> FloatArray | None:
    """Return the (m, 4, 4) motions after which a target looks as before."""
    if target is None:
        return None
    from handeye_cli import targets
    from handeye_cli.geometry.plate_turns import plate_turns

    board = targets.build(target)
    return plate_turns(board.points(), board.turns())


def _rough(chain: Chain, given: Noise | None) -> tuple[Solution, NoiseModel]:
    """Return the closed form's answer on all stations, and the noise it shows."""
    count = len(chain.A)
    problem = Problem(chain.A, chain.B, star_pairs(count), np.zeros((count, 12, 12)))
    solution = tsai_lenz.solve(problem)
    return solution, noise_model(chain, given, solution)


def _loops(chain: Chain, model: NoiseModel) -> BlockLoops:
    known = model.covariance - np.tensordot(model.variances, model.shapes, axes=1)
    known = known + chain.by_causes @ np.swapaxes(chain.by_causes, -1, -2)
    one_target = np.zeros(len(chain.A), dtype=np.int64)
    return BlockLoops(chain.A, chain.B, known, model.shapes, one_target)


def _start(solution: Solution, model: NoiseModel) -> BlockFit:
    size = len(model.variances)
    return BlockFit(
        X=solution.X,
        Z=solution.Z[None],
        variances=model.variances,
        spread=np.zeros((size, size)),
        covariance=np.zeros((12, 12)),
        slopes=np.zeros((size, 12, 12)),
    )


def _all_well(everybody: Agreement) -> bool:
    """Return whether the ordinary fit leaves nothing that chance does not explain."""
    count = len(everybody.rows)
    if likeliest_move(everybody)[1] < _SUSPICIOUS:
        return False
    return count * largest_contradiction(everybody)[1] >= _SUSPICIOUS


def _likelier(everybody: Agreement, best: Agreement) -> Agreement:
    """Return the ordinary fit where it contradicts nobody and is likelier than one without some.

    Of four or five stations three or four may agree by the symmetry of half turns on what the
    others rule out.
    """
    if largest_contradiction(everybody)[1] < level(everybody.loops):
        return best
    return min(everybody, best, key=lambda agreed: cost(agreed, agreed.outside))


def _outliers(agreed: Agreement, exchanged: set[int]) -> tuple[BadStation, ...]:
    distances, turned = agreed.distances, _turned(agreed)
    chances = distances.chances(MOST_FREEDOM)
    rotation = np.linalg.norm(distances.residuals[:, 3:], axis=1)
    translation = np.linalg.norm(distances.residuals[:, :3], axis=1)
    return tuple(
        BadStation(
            row=row,
            rotation=float(rotation[row]),
            translation=float(translation[row]),
            sigmas=float(np.sqrt(distances.squares[row])),
            chance=float(chances[row]),
            kind=_kind(row in exchanged, bool(turned[row])),
        )
        for row in np.flatnonzero(~agreed.rows).tolist()
    )


def _kind(exchanged: bool, turned: bool) -> BadKind:
    if exchanged:
        return BadKind.EXCHANGED
    return BadKind.TURNED if turned else BadKind.ELSEWHERE


def _turned(agreed: Agreement) -> BoolArray:
    """Return (N,) whether stations see the target turned about its normal by quarters."""
    loops, found = agreed.loops, agreed.found
    seen = se3.inverse(found.Z[loops.blocks]) @ loops.A @ found.X @ loops.B
    turn = rotations.log(seen[:, :3, :3])
    quarters = np.round(np.abs(turn[:, 2]) / _QUARTER)
    off = np.hypot(np.hypot(turn[:, 0], turn[:, 1]), np.abs(turn[:, 2]) - quarters * _QUARTER)
    return np.asarray((quarters > 0) & (off < _NEAR_QUARTER))


def _scale(chain: Chain, given: Noise | None, agreed: Agreement, moved: TargetMove | None) -> Noise:
    """Return the noise that the good stations of one place of the target show."""
    good = agreed.rows.copy()
    good[list(moved.rows if moved else ())] = False
    rows = np.flatnonzero(good)
    block = int(agreed.loops.blocks[rows[0]])
    solution = Solution(agreed.found.X, agreed.found.Z[block])
    return noise_model(chain.part(rows), given, solution).noise
