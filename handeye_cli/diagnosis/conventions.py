"""The verdict on conventions: whether the declared ones fit, and if not, which do.

The residuals of a reading need no noise model: what the declared reading leaves is compared with
what the best other one leaves. A contradiction takes clear evidence, as many stations may be few,
noisy, or placed so that several readings are equally true - on a perfect circle about the target,
poses the other way round, lists shifted against each other and any size of the target all fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis import hypotheses
from handeye_cli.diagnosis.fits import (
    Fit,
    as_good,
    clear_factor,
    clearly_better,
    fit,
    gains,
    simplest,
)
from handeye_cli.diagnosis.lengths import LengthFault, length_fault, length_ratio, unchecked_lengths
from handeye_cli.diagnosis.readings import Reading, reading_of
from handeye_cli.records import Finding, Stations, TargetSpec
from handeye_cli.records.hypotheses import ConventionVerdict, HypothesisFit, LengthRatio

_MOST_STATIONS = 400
"""Stations that the declared reading is judged by; more would not change what they say."""
_MOST_COMPARED = 60
"""The same of all other readings."""
_WELL = 0.03
"""Share of the camera's turns and of the motions' lengths up to which nothing else is tried."""
_CONTRADICTION = (0.06, 0.1)
"""Loops that miss by more than this (radians, median) are not those of one calibration: by the
first where the camera turns little, by the second in any case."""
_MISSED = 0.5
"""Share of the camera's turns or of the motions' lengths that is missed then."""
_OTHER_ANGLES = 0.05
"""Median difference in radians above which robot and camera make other motions."""
_HIDDEN = 4.0
"""Turns across the main axis below this multiple of the noise leave one axis only."""
_LARGEST_NOISE = 0.02
"""Radians; a residual above this is a fault and not noise."""
_LEAST_TURN = 1e-3
"""Radians below which no robot turns."""
_MOST_LEFT_OUT = 20
"""Of more stations a few bad ones are found without leaving each out."""
_MUCH_BETTER = 1.0
"""Natural logarithm of the factor by which both residuals have to become smaller together."""
_MOST_NAMED = 3
"""Readings that are named where several fit equally well."""


def judge_conventions(
    stations: Stations, chain: Chain, *, thorough: bool = False
) -> ConventionVerdict:
    """Judge whether the stations fit the conventions they were declared in.

    Other readings are tried where the declared one does not fit well. Nothing is said of stations
    that turn about one axis only: they fit too much.

    Args:
        stations: The document, for its names, its target, and how its numbers were written.
        chain: Its usable stations.
        thorough: Whether other readings are tried in any case, and those that fit as well named.
    """
    widely = reading_of(stations, chain, _MOST_STATIONS)
    declared = fit([hypotheses.declared(widely)])[0]
    if _fits_well(declared) and not thorough:
        return _Case(stations.target, widely, declared, ()).verdict([declared])
    from handeye_cli.diagnosis import pairings

    reading = reading_of(stations, chain, _MOST_COMPARED)
    rows = [hypotheses.declared(reading), *hypotheses.conventions(reading)]
    declared, *others = fit([*rows, *pairings.pairings(reading)])
    if _contradicted(declared) or any(clearly_better(other, declared) for other in others):
        declared = _defended(declared)
    case = _Case(stations.target, reading, declared, tuple(others))
    if case.one_axis():
        return case.silence()
    candidates = simplest([other for other in others if clearly_better(other, declared)])
    wrong = bool(candidates) or _contradicted(declared)
    if wrong and all(each.hypothesis.paired_anew or each.left_out > 1 for each in candidates):
        from handeye_cli.diagnosis.two_places import moved_fit

        moved = moved_fit(stations, chain, reading, declared)
        if moved is not None:
            return case.with_move(moved, candidates)
    if candidates:
        return case.verdict(candidates)
    notes = case.not_told_apart() if thorough and not wrong else ()
    return case.unexplained() if wrong else case.verdict([declared], notes)


def _defended(declared: Fit) -> Fit:
    """Return the declared reading as it fits best with as many stations trusted as before.

    The search for bad stations among few may go astray; who contradicts a user has to be sure.
    """
    reading, count = declared.hypothesis, len(declared.hypothesis.mask)
    if not declared.trusted < count <= _MOST_LEFT_OUT:
        return declared
    without_one = [replace(reading, mask=mask) for mask in ~np.eye(count, dtype=bool)]
    best = min(fit(without_one, trusted=declared.trusted), key=lambda each: each.score)
    return best if best.score < declared.score - _MUCH_BETTER else declared


def _fits_well(declared: Fit) -> bool:
    """Return whether no other reading can fit much better."""
    turned, moved = declared.rotation, declared.apart
    fits = turned <= _WELL * declared.turns and moved <= _WELL * declared.reach
    return fits and declared.turns > _LEAST_TURN


def _contradicted(declared: Fit) -> bool:
    turned, moved = declared.typical
    limit = np.clip(_MISSED * declared.turns, *_CONTRADICTION)
    return bool(turned > limit or moved > _MISSED * declared.reach)


@dataclass(frozen=True)
class _Case:
    """What a verdict is made from.

    Attributes:
        target: What the target was declared to be.
        reading: The numbers as declared.
        declared: How well they fit so.
        others: How well other readings fit.
    """

    target: TargetSpec | None
    reading: Reading
    declared: Fit
    others: tuple[Fit, ...]

    def one_axis(self) -> bool:
        """Return whether the camera turns about one axis only, as far as the noise shows."""
        noise = min(each.least_rotation for each in (self.declared, *self.others))
        limit = _HIDDEN * noise if noise <= _LARGEST_NOISE else _LARGEST_NOISE
        return self.declared.turns <= max(limit, _LEAST_TURN)

    def silence(self) -> ConventionVerdict:
        """Return the verdict that says nothing."""
        return self._with(self.declared, LengthRatio(1.0, math.inf), None, ())

    def verdict(self, equals: Sequence[Fit], notes: Sequence[Finding] = ()) -> ConventionVerdict:
        """Return the verdict for readings that fit equally well, the preferred one first."""
        best = equals[0]
        scale = length_ratio(best)
        fault = length_fault(best, scale, self.target, from_pixels=self.reading.from_pixels)
        as_declared = best.hypothesis.code in hypotheses.AS_DECLARED
        found = [] if as_declared else [_finding(self.declared, equals)]
        found += [fault.finding] if fault else []
        if not found:
            unchecked = unchecked_lengths(best, scale, self.target, self.reading.setup.answer)
            found += [unchecked] if unchecked else []
        return self._with(best, scale, fault, (*found, *notes))

    def with_move(self, moved: Fit, pairings: Sequence[Fit]) -> ConventionVerdict:
        """Return the verdict where a target that was moved explains the stations.

        Args:
            moved: How well it does.
            pairings: Other ways to pair the lists that do, too, the preferred one first.
        """
        from handeye_cli.diagnosis.two_places import explains_as_much, explains_more

        case = replace(self, others=(moved, *self.others))
        if all(explains_more(moved, each) for each in pairings):
            return case.verdict([moved])
        as_well = [moved] if explains_as_much(moved, pairings[0]) else []
        return case.verdict([*pairings, *as_well])

    def unexplained(self) -> ConventionVerdict:
        """Return the verdict on stations that no convention and no shift explains."""
        from handeye_cli.diagnosis import shuffles

        pairing = shuffles.found_pairing(self.reading)
        if pairing is not None:
            paired = fit([pairing])[0]
            if clearly_better(paired, self.declared):
                case = _Case(self.target, self.reading, self.declared, (paired, *self.others))
                return case.verdict([paired])
        finding = _unexplained(self.declared, shuffles.angle_difference(self.reading))
        return self._with(self.declared, LengthRatio(1.0, math.inf), None, (finding,))

    def not_told_apart(self) -> tuple[Finding, ...]:
        """Return a note on readings that fit as well as the declared one."""
        known = self.declared.left_out
        equals = [
            each for each in self.others if as_good(each, self.declared) and each.left_out <= known
        ]
        words = list(
            {each.hypothesis.code: each.hypothesis.description for each in equals}.values()
        )
        if not words:
            return ()
        named = "; ".join(words[:_MOST_NAMED])
        message = f"these stations fit as declared, and as well if {named}: they do not tell which"
        advice = "turn the camera about its own axis as well, and vary its distance from the target"
        return (Finding("conventions-not-told-apart", "info", message, advice),)

    def _with(
        self,
        best: Fit,
        scale: LengthRatio,
        fault: LengthFault | None,
        findings: tuple[Finding, ...],
    ) -> ConventionVerdict:
        ordered = [best, *sorted((self.declared, *self.others), key=lambda each: each.score)]
        first_of_code = {each.hypothesis.code: each for each in reversed(ordered)}
        declared = _row(self.declared)
        rows = [
            declared if each is self.declared else _row(each)
            for each in dict.fromkeys(first_of_code[each.hypothesis.code] for each in ordered)
        ]
        if fault is not None and best is self.declared:
            rows.insert(0, _row_of_lengths(best, fault))
        return ConventionVerdict(
            hypotheses=tuple(rows),
            declared=declared,
            best=rows[0],
            scale=scale,
            findings=findings,
            contradiction=any(finding.severity == "error" for finding in findings),
        )


def _row(found: Fit) -> HypothesisFit:
    reading = found.hypothesis
    as_declared = reading.code in hypotheses.AS_DECLARED
    translation = found.apart if as_declared else found.matched
    return HypothesisFit(
        reading.code, reading.description, reading.flag, found.rotation, translation
    )


def _row_of_lengths(found: Fit, fault: LengthFault) -> HypothesisFit:
    code = fault.finding.code
    return HypothesisFit(code, fault.description, fault.flag, found.rotation, found.matched)


def _finding(declared: Fit, equals: Sequence[Fit]) -> Finding:
    best, *others = equals
    by_turns, by_lengths = gains(best, declared)
    turned = by_turns >= min(clear_factor(best, declared), by_lengths)
    before = _angle_text(declared, 3) if turned else _length_text(declared.apart)
    said = "turned" if turned else "moved"
    message = f"the stations see the target {said} by {before} as declared, {_fits(best, turned)}"
    named = [each for each in others if not each.hypothesis.paired_anew][:_MOST_NAMED]
    message += "".join(f", and as well {_fits(each, turned)}" for each in named)
    return Finding(best.hypothesis.code, "error", message, best.hypothesis.advice)


def _fits(found: Fit, turned: bool) -> str:
    """Return how well a reading fits, in its turns or in its lengths, and what it is."""
    size = _angle_text(found, 2) if turned else _length_text(found.matched)
    return f"{size} if {found.hypothesis.description}"


def _angle_text(found: Fit, digits: int) -> str:
    return f"{np.degrees(found.rotation):.{digits}g} deg"


def _length_text(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1.0 else f"{1e3 * metres:.3g} mm"


def _unexplained(declared: Fit, angles: float) -> Finding:
    from handeye_cli.diagnosis.shuffles import SHUFFLED

    turned, moved = declared.typical
    tried = "no other convention and no shift of the lists explains it"
    if angles > _OTHER_ANGLES:
        return Finding(
            SHUFFLED,
            "error",
            "the camera does not turn by the same angles as the robot: a median difference of "
            f"{np.degrees(angles):.3g} deg between stations; {tried}",
            "check that images and robot poses belong together, and how the robot's rotations were "
            "computed, such as the order of Euler angles",
        )
    return Finding(
        "no-convention-fits",
        "error",
        f"the stations see the target turned by {np.degrees(turned):.3g} deg and moved by "
        f"{_length_text(moved)} in the median; {tried}",
        "check that target and camera stay where they are fixed, and the frames of the robot's "
        "poses",
    )
