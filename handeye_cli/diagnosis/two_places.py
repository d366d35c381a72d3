"""The hypothesis that the target was moved, so that it can stand beside other readings.

On a circle of stations, lists that are shifted against each other and a target that was moved leave
residuals that look alike; only a comparison of both tells how many stations each of them explains.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.bad_stations import agreement_on_two_places
from handeye_cli.diagnosis.fits import Fit, as_good, clear_factor, clearly_better, fit
from handeye_cli.diagnosis.hypotheses import MOVED, Hypothesis
from handeye_cli.diagnosis.lengths import length_ratio
from handeye_cli.diagnosis.moved_target import move_of
from handeye_cli.diagnosis.readings import Reading
from handeye_cli.geometry import se3
from handeye_cli.records import Stations

_UNKNOWNS = 3
"""Of the second place, in rotation and in translation each."""


def moved_fit(stations: Stations, chain: Chain, reading: Reading, declared: Fit) -> Fit | None:
    """Return how well the stations fit if the target was moved once, all else being as declared.

    Args:
        stations: The document, for its noise and its setup.
        chain: Its usable stations.
        reading: The numbers of those to compare.
        declared: How well they fit without a move.

    Returns:
        The fit, or None where a move does not explain the stations clearly better.
    """
    chosen = chain.part(np.flatnonzero(np.isin(chain.index, reading.index)))
    hypothesis = _moved(stations, chosen, reading)
    if hypothesis is None:
        return None
    found = fit([hypothesis])[0]
    return found if _clearly_better(found, declared) else None


def _moved(stations: Stations, chain: Chain, reading: Reading) -> Hypothesis | None:
    try:
        split = agreement_on_two_places(chain, stations.noise)
    except np.linalg.LinAlgError:
        # motions that determine nothing determine no move
        return None
    if split is None:
        return None
    move = move_of(split)
    before, after = (reading.names[reading.index[row]] for row in (move.before, move.after))
    first, second = split.found.Z
    back = np.where(split.loops.blocks[:, None, None], first @ se3.inverse(second), np.eye(4))
    return Hypothesis(
        code=MOVED,
        description=f'the target was moved between stations "{before}" and "{after}"',
        flag="",
        advice=f"fix the target to the {stations.setup.reference} and record again",
        A=back @ chain.A,
        B=chain.B,
        mask=np.ones(len(chain.A), dtype=bool),
        more_unknowns=_UNKNOWNS,
    )


def _clearly_better(moved: Fit, declared: Fit) -> bool:
    """Return whether a move is needed; the lengths are as they are in either case."""
    turned = declared.least_rotation / moved.least_rotation
    lengths = declared.apart / max(moved.apart, moved.least_translation)
    return max(turned, lengths) >= clear_factor(moved, declared) and moved.like_noise


def explains_more(moved: Fit, pairing: Fit) -> bool:
    """Return whether a move leaves fewer faults than stations paired in another way.

    The move is a fault itself, and so is every station that does not agree or that a shift drops. A
    pairing that leaves few stations fits well whatever is true, hence the factor that chance does
    not bring about. What noise as large as the pairing shows explains is no fault of the move.
    """
    pairing = _with_told_lengths(pairing)
    faults = moved.unexplained_by(pairing) + 1
    return faults < pairing.left_out and not clearly_better(pairing, moved)


def explains_as_much(moved: Fit, pairing: Fit) -> bool:
    """Return whether neither of the two can be preferred."""
    pairing = _with_told_lengths(pairing)
    as_few = moved.unexplained_by(pairing) <= pairing.left_out
    return as_few and (as_good(moved, pairing) or not clearly_better(pairing, moved))


def _with_told_lengths(pairing: Fit) -> Fit:
    """Return a pairing with its lengths as they are, where its motions do not tell their ratio.

    A ratio that is fitted to noise explains that noise, and no move has it.
    """
    told = math.isfinite(length_ratio(pairing).sigma)
    return pairing if told else replace(pairing, translation=pairing.apart)
