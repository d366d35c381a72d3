"""The report of an inspection: what the data are fit for, and what speaks for it."""

from __future__ import annotations

import math

from rich.console import Console

from handeye_cli.diagnosis.lengths import ratio_words
from handeye_cli.records import BlameShares, HypothesisFit, Inspection, LengthRatio, SmoothResiduals
from handeye_cli.records.moving import TimeOffset
from handeye_cli.render.console import show_paragraph, show_table
from handeye_cli.render.recording_summary import show_recording_summary
from handeye_cli.render.residuals import show_residuals
from handeye_cli.render.text import NOTHING, count, deg, mm, mrad, pixels

_CAUSES = ("robot", "camera", "intrinsics", "plate", "timing")


def show_inspection(inspection: Inspection, console: Console) -> None:
    """Print an inspection, its verdict first; its findings are not part of it."""
    console.print(f"{_verdict(inspection)}{_scope(inspection)}\n", style="bold")
    if inspection.recording is not None:
        show_recording_summary(inspection.recording, console)
    if inspection.time_offset is not None:
        _show_time_offset(inspection.time_offset, console)
    if inspection.stations:
        _show_stations(inspection, console)


def _show_time_offset(time: TimeOffset, console: Console) -> None:
    sigma = _ms(time.sigma)
    console.print(f"Time between images and poses, from {count(time.frames, 'frame')} in motion")
    rows = [["to add to the images' times", f"{_ms(time.offset)} +- {sigma}", "ms"]]
    if time.given:
        rows.append(["as given", _ms(time.given), "ms"])
    rows.append(["scatter of single images", _ms(time.jitter), "ms"])
    show_table(console, ["", "", ""], rows, left=[0, 2])


def _show_stations(inspection: Inspection, console: Console) -> None:
    if inspection.predicted_error is not None:
        error = inspection.predicted_error
        console.print(
            f"An answer from these data is expected to be {mrad(error.rotation)} mrad and "
            f"{mm(error.translation)} mm\nfrom the truth (RMS)\n"
        )
    if inspection.hypotheses:
        console.print("Readings of the conventions, and how well the stations agree")
        _show_hypotheses(inspection.hypotheses, inspection.length_ratio, console)
    if inspection.blame is not None:
        _show_blame(inspection.blame, console)
    if inspection.surfaces is not None:
        _show_surfaces(inspection.surfaces, console)
    console.print("Residuals of the stations")
    show_residuals(inspection.stations, console)


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.2f}"


def _scope(inspection: Inspection) -> str:
    used = sum(station.used for station in inspection.stations)
    stations = f"{used} of {count(len(inspection.stations), 'station')} usable"
    known = [
        inspection.setup.value if inspection.setup else "",
        stations if inspection.stations else "",
    ]
    return f" ({', '.join(filter(None, known))})" if any(known) else ""


def _verdict(inspection: Inspection) -> str:
    if not inspection.stations and inspection.recording is not None:
        reads = "cannot be read as it is" if inspection.errors else "can be read"
        return f"This recording {reads}"
    if inspection.errors:
        return "An answer from these data would be meaningless"
    if any(finding.severity == "warning" for finding in inspection.diagnosis):
        return "These data give an answer, with reservations"
    return "These data give an answer"


def _show_hypotheses(
    hypotheses: tuple[HypothesisFit, ...], ratio: LengthRatio | None, console: Console
) -> None:
    rows = [
        [
            "as declared" if fit.code == "declared" else fit.description,
            deg(fit.rotation),
            mm(fit.translation),
            fit.flag,
        ]
        for fit in hypotheses
    ]
    show_table(console, ["", "rotation\ndeg", "translation\nmm", "flag"], rows, left=[0, 3])
    if ratio is not None and math.isfinite(ratio.sigma):
        show_paragraph(console, ratio_words(ratio), margin="  ")
        console.print()


def _show_blame(blame: BlameShares, console: Console) -> None:
    show_paragraph(console, f"What the residuals come from: {blame.words or blame.limit}")
    rows = [
        [
            cause,
            *(_percent(getattr(blame, f"{cause}_{part}")) for part in ("rotation", "translation")),
        ]
        for cause in _CAUSES
    ]
    known = [row for row in rows if any(cell != NOTHING for cell in row[1:])]
    if known:
        show_table(console, ["", "rotation\n%", "translation\n%"], known, left=[0])


def _percent(share: float | None) -> str:
    return NOTHING if share is None else f"{100.0 * share:.0f}"


def _show_surfaces(seen: SmoothResiduals, console: Console) -> None:
    rows = [
        ["residual in the images", pixels(seen.pixel), "px"],
        ["without what is smooth over plate or image", pixels(seen.pixel_left), "px"],
    ]
    if math.isfinite(seen.bow_sigma):
        rows.append(["bow of the plate", f"{mm(seen.bow)} +- {mm(seen.bow_sigma)}", "mm"])
    console.print("Smooth parts of the residuals in the images")
    show_table(console, ["", "", ""], rows, left=[0, 2])
