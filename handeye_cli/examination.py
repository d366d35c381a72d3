"""What is wrong with stations before they are solved: their conventions, and bad ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from handeye_cli.chain import Chain, has_pixels
from handeye_cli.diagnosis.bad_findings import findings_of_bad, reasons_of_bad
from handeye_cli.diagnosis.bad_stations import find_bad_stations
from handeye_cli.diagnosis.conventions import judge_conventions
from handeye_cli.errors import UndeterminedError
from handeye_cli.finding_codes import INTRINSICS_DOUBTFUL
from handeye_cli.records import BadStations, ConventionVerdict, Finding, Stations

if TYPE_CHECKING:
    from handeye_cli.diagnosis.plate_shape import PlateShape


@dataclass(frozen=True)
class Examined:
    """The stations of a document that an answer should rest on.

    Attributes:
        stations: The document.
        everybody: The chain of all its usable stations.
        chain: That of the good ones.
        verdict: Whether they fit what was declared of them.
        reasons: Why stations are left out, by their position in the document.
        findings: What is wrong with them.
    """

    stations: Stations
    everybody: Chain
    chain: Chain
    verdict: ConventionVerdict
    reasons: Mapping[int, str]
    findings: tuple[Finding, ...]

    @cached_property
    def shape(self) -> PlateShape | None:
        """What the pixels say of the plate and the lens, where there are pixels."""
        if not has_pixels(self.stations, self.chain):
            return None
        from handeye_cli.diagnosis.plate_shape import plate_shape

        return plate_shape(self.stations)

    @property
    def errors(self) -> tuple[Finding, ...]:
        """What makes an answer meaningless."""
        return tuple(finding for finding in self.findings if finding.severity == "error")


def examine(stations: Stations, everybody: Chain, *, thorough: bool = False) -> Examined:
    """Look for contradictions among stations and between them and what was declared of them.

    Args:
        stations: The document.
        everybody: The chain of its usable stations.
        thorough: Whether other conventions are tried even where the declared ones fit.
    """
    verdict = judge_conventions(stations, everybody, thorough=thorough)
    if verdict.contradiction:
        return Examined(stations, everybody, everybody, verdict, {}, verdict.findings)
    if any(finding.code == INTRINSICS_DOUBTFUL for finding in stations.findings):
        # poses by wrong intrinsics disagree without any of them being a mistake
        return Examined(stations, everybody, everybody, verdict, {}, verdict.findings)
    bad = _bad_stations(everybody, stations)
    names = [stations.stations[index].name for index in everybody.index]
    reasons = reasons_of_bad(bad, names)
    return Examined(
        stations=stations,
        everybody=everybody,
        chain=everybody.part(bad.kept) if reasons else everybody,
        verdict=verdict,
        reasons={int(everybody.index[row]): reason for row, reason in reasons.items()},
        findings=(*verdict.findings, *findings_of_bad(bad, names, stations.setup)),
    )


def _bad_stations(everybody: Chain, stations: Stations) -> BadStations:
    try:
        return find_bad_stations(everybody, stations.noise, stations.target)
    except np.linalg.LinAlgError:
        # motions that determine nothing are told of where an answer is tried
        return BadStations(len(everybody.A))


def require_conventions(stations: Stations, everybody: Chain) -> None:
    """Refuse stations that contradict what was declared of them.

    Raises:
        UndeterminedError: They do; it names what fits.
    """
    _refuse(judge_conventions(stations, everybody).findings)


def require_sound(examined: Examined) -> None:
    """Refuse stations from which an answer would be meaningless.

    Raises:
        UndeterminedError: They contradict each other, or what was declared of them.
    """
    _refuse(examined.findings)


def _refuse(findings: tuple[Finding, ...]) -> None:
    for finding in findings:
        if finding.severity == "error":
            raise UndeterminedError(finding.message, hint=finding.advice or None)
