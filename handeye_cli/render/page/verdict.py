"""The first thing on a page: the traffic light, why it shows that colour, and the numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.geometry import rotations
from handeye_cli.records import Calibration, PredictedError, VerificationRow
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import bullets, element, lamp, paragraph, text
from handeye_cli.render.text import count, fixed, mm, mrad
from handeye_cli.reporting.colour import Colour
from handeye_cli.reporting.contents import Contents
from handeye_cli.reporting.light import NOT_VERIFIED, Light

HEADING = "Verdict"

_SENTENCES = {
    Colour.RED: "Do not rely on this",
    Colour.AMBER: "Usable, with reservations",
    Colour.GREEN: "Good to use",
}
_OF_SEVERAL = "Do not rely on all of these"


def body(contents: Contents, _: Desk) -> str:
    """Return the light and the numbers that matter most; nothing where there is none to judge."""
    case, light = contents.case, contents.light
    answer = case.calibration
    tiles = list(_tiles(contents))
    if light is None and not tiles:
        return ""
    shown = "" if light is None else _light(light, several=bool(case.batches))
    if answer is not None:
        shown += _place(answer)
    shown += element("div", "".join(tiles), "tiles")
    if contents.seen is not None and answer is not None:
        shown += paragraph(
            "An error seen at a station holds that station's own noise too, and so does what is "
            "expected there.",
            "note",
        )
    return shown


def _light(light: Light, *, several: bool) -> str:
    doubt = "" if light.verified or NOT_VERIFIED in light.reasons else f" ({NOT_VERIFIED})"
    red = several and light.colour is Colour.RED
    sentence = f"{_OF_SEVERAL if red else _SENTENCES[light.colour]}{doubt}"
    words = element("strong", text(sentence)) + bullets(light.reasons)
    return element("div", lamp(light.colour) + element("div", words), f"light {light.colour}")


def _place(answer: Calibration) -> str:
    pose = answer.mount_T_camera.matrix
    x, y, z = fixed(pose[:3, 3] / MM, 3)
    turn = ", ".join(fixed(np.degrees(rotations.log(pose[:3, :3])), 3))
    setup = answer.setup
    return paragraph(
        f"{setup.answer}: in the frame of the {setup.mount} the camera is at x {x}, y {y}, z {z} "
        f"mm, turned by the rotation vector ({turn}) deg.",
        "lead",
    )


def _tiles(contents: Contents) -> Iterator[str]:
    case = contents.case
    if case.calibration is not None:
        yield from _predicted(case.calibration.predicted_error)
    elif case.inspection is not None and case.inspection.predicted_error is not None:
        yield from _predicted(case.inspection.predicted_error)
    if contents.seen is not None:
        yield _seen(contents.seen[1])
    rows = case.calibration or case.inspection
    if rows is not None and rows.stations:
        used = sum(each.used for each in rows.stations)
        yield _tile("Stations used", [f"{used} of {len(rows.stations)}"], "")


def _predicted(error: PredictedError) -> Iterator[str]:
    yield _tile("Predicted error, RMS", _both(error.rotation, error.translation), "of the answer")
    yield _tile("95 % of answers are within", _both(error.rotation_95, error.translation_95), "")


def _seen(row: VerificationRow) -> str:
    expected = ""
    if row.predicted_rotation is not None:
        expected = " and ".join(_both(row.predicted_rotation, row.predicted_translation))
        expected = f"expected there: {expected}; "
    where = f"{expected}calibrated on {count(row.stations, 'station')}"
    return _tile("Seen at stations left out, RMS", _both(row.rotation, row.translation), where)


def _both(rotation: float | None, translation: float | None) -> list[str]:
    return [f"{mrad(rotation)} mrad", f"{mm(translation)} mm"]


def _tile(name: str, values: list[str], note: str) -> str:
    big = "".join(element("strong", text(value)) for value in values)
    return element("div", paragraph(name) + big + element("small", text(note)), "tile")
