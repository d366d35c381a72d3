"""The report of a verification: the table of the paper, section IV-B, and the verdict in words."""

from __future__ import annotations

from rich.console import Console

from handeye_cli.records import Protocol, Verification, VerificationRow
from handeye_cli.render.console import show_table
from handeye_cli.render.text import count, mil, mm, mrad, pixels

_PROTOCOLS = {
    Protocol.SPLIT: "Each row calibrates on the first N stations and predicts the next N",
    Protocol.LEAVE_ONE_OUT: "Each station is predicted by a calibration on all others",
    Protocol.CALIBRATION: "An existing calibration predicts new stations",
    Protocol.MOVED_TARGET: "An existing calibration predicts new stations; "
    "the target, which was\nmoved, is where the other new stations see it",
}
_VERDICTS = {
    True: "the errors are as predicted",
    False: "the errors contradict the prediction, beyond chance",
    None: "nothing predicts the errors",
}


def show_verification(verification: Verification, console: Console) -> None:
    """Print the held-out errors and the verdict, then each station of a single row."""
    console.print(
        f"Errors on stations that took no part ({verification.setup.value}, {verification.method})",
        style="bold",
    )
    console.print(f"{_PROTOCOLS[verification.protocol]}.")
    console.print("RMS over the stations predicted; expected from the covariances\n")
    seen = any(row.reprojection is not None for row in verification.rows)
    headings = [
        "calibrated\non",
        "rotation\nmrad",
        "expected\nmrad",
        "translation\nmm",
        "\nmil",
        "expected\nmm",
        "image\npx" if seen else "",
        "plate\nmm" if seen else "",
    ]
    rows = [_cells(row, seen) for row in verification.rows]
    show_table(console, headings, rows, left=[])
    for row in verification.rows:
        console.print(f"Calibrated on {count(row.stations, 'station')}: {_verdict(row)}.")
    if len(verification.rows) == 1:
        console.print()
        _show_stations(verification.rows[0], seen, console)


def _verdict(row: VerificationRow) -> str:
    return _VERDICTS[row.consistent]


def _cells(row: VerificationRow, seen: bool) -> list[str]:
    return [
        str(row.stations),
        mrad(row.rotation),
        mrad(row.predicted_rotation),
        mm(row.translation),
        mil(row.translation),
        mm(row.predicted_translation),
        pixels(row.reprojection) if seen else "",
        mm(row.plate) if seen else "",
    ]


def _show_stations(row: VerificationRow, seen: bool, console: Console) -> None:
    rows = [
        [
            each.name,
            mrad(each.rotation),
            mm(each.translation),
            pixels(each.reprojection) if seen else "",
            mm(each.plate) if seen else "",
        ]
        for each in row.errors
    ]
    headings = ["station", "rotation\nmrad", "translation\nmm"]
    headings += ["image\npx", "plate\nmm"] if seen else ["", ""]
    show_table(console, headings, rows, left=[0])
