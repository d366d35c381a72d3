"""The report of a verification: the table of the paper, section IV-B."""

from __future__ import annotations

from rich.console import Console

from handeye_cli.records import Verification, VerificationRow
from handeye_cli.render.console import show_table
from handeye_cli.render.text import mil, mm, mrad

_JUDGEMENT = {True: "yes", False: "no", None: ""}


def show_verification(verification: Verification, console: Console) -> None:
    """Print the held-out errors, and each station's own where there is a single row."""
    console.print(
        f"Errors on stations that took no part ({verification.setup.value}, {verification.method})",
        style="bold",
    )
    console.print("RMS over the verification stations; predicted from the covariances\n")
    judged = any(row.consistent is not None for row in verification.rows)
    headings = [
        "calibrated\non",
        "rotation\nmrad",
        "predicted\nmrad",
        "translation\nmm",
        "\nmil",
        "predicted\nmm",
        "as\npredicted" if judged else "",
    ]
    show_table(console, headings, map(_cells, verification.rows), left=[6])
    if len(verification.rows) == 1:
        _show_stations(verification.rows[0], console)


def _cells(row: VerificationRow) -> list[str]:
    return [
        str(row.stations),
        mrad(row.rotation),
        mrad(row.predicted_rotation),
        mm(row.translation),
        mil(row.translation),
        mm(row.predicted_translation),
        _JUDGEMENT[row.consistent],
    ]


def _show_stations(row: VerificationRow, console: Console) -> None:
    rows = [[each.name, mrad(each.rotation), mm(each.translation)] for each in row.errors]
    show_table(console, ["station", "rotation\nmrad", "translation\nmm"], rows, left=[0])
