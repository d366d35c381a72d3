"""The verifications of a report: all rows that can be had, and why others cannot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import general_scene, scene, stations

from handeye_cli.geometry import se3
from handeye_cli.pipeline import Steps
from handeye_cli.records import Noise, Protocol
from handeye_cli.reporting.verifying import Approach, verified

APPROACH = Approach(Steps(workers=1), "maximum-likelihood", "star")
NOISE = Noise(2e-4, 1e-4, 2e-4, 1e-4)


def numbers(found):
    """Return the stations of the rows of the paper's table."""
    return [
        row.stations
        for each in found.verifications
        if each.protocol is Protocol.SPLIT
        for row in each.rows
    ]


def document(perfect, seed=3):
    return stations(np.random.default_rng(seed), perfect, NOISE)


def turned_late(count, straight):
    """Stations of which the first only move along straight lines."""
    rng = np.random.default_rng(8)
    whole = scene(rng, count)
    B = whole.B.copy()
    B[:straight, :3, :3] = B[0, :3, :3]
    return replace(whole, B=B, A=whole.Z @ se3.inverse(B) @ se3.inverse(whole.X))


def test_stations_that_all_turn_need_no_remark():
    found = verified(document(general_scene(np.random.default_rng(2), 12)), APPROACH)
    assert numbers(found) == [4, 5, 6]
    assert [each.protocol for each in found.verifications][-1] is Protocol.LEAVE_ONE_OUT
    assert found.remarks == ()


def test_rows_that_determine_nothing_are_missing_with_the_reason():
    found = verified(document(turned_late(12, 4)), APPROACH)
    assert numbers(found) == [6]
    (remark,) = found.remarks
    assert remark.startswith("No row calibrates on the first 4 or 5 stations; with 5: ")


def test_where_no_row_is_left_the_stations_are_taken_in_another_order():
    late = document(turned_late(14, 8))
    found = verified(late, APPROACH)
    assert numbers(found)
    why, order = found.remarks[:2]
    assert why.startswith("No row calibrates on the first 4, 5, 6 or 7 stations; with 7: ")
    names = order.removesuffix(".").split(": ")[1].split(", ")
    assert sorted(names) == [each.name for each in late.stations]
    # wherever one stops, the stations so far come from both halves
    assert all(0 < sum(int(name) < 7 for name in names[:n]) < n for n in range(2, 14))
    errors = [each.name for each in found.verifications[0].rows[-1].errors]
    assert errors == names[7:14]


def test_too_few_stations_to_hold_any_back_are_told_as_such():
    found = verified(document(general_scene(np.random.default_rng(2), 5)), APPROACH)
    assert numbers(found) == []
    assert found.remarks == (
        "There are no errors against the number of stations: expected at least 6 usable stations, "
        "half to calibrate on and half to verify with, found 5.",
    )


@pytest.mark.parametrize("count", [6, 7])
def test_a_single_row_needs_six_stations(count):
    found = verified(document(general_scene(np.random.default_rng(2), count)), APPROACH)
    assert numbers(found) == [3]
    assert found.remarks == ()
