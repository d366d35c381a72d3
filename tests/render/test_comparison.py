"""The table of all methods."""

import io

from handeye_cli.records import Comparison
from handeye_cli.render.comparison import show_comparison
from handeye_cli.render.console import make_console


def shown(*rows):
    stream = io.StringIO()
    show_comparison(rows, make_console(stream))
    return stream.getvalue().splitlines()


def test_methods_stand_below_each_other_with_what_is_missing_below():
    lines = shown(
        Comparison("maximum-likelihood", 0.0, 0.0, 8.1e-4, 1.9e-4, 9.3e-4, 2.7e-4),
        Comparison("li", 1e-4, 2e-5, 9e-4, 2e-4, reason="no held-out error: found 3"),
        Comparison("andreff", reason="one axis\x1b[2J only"),
    )
    assert [line.rstrip() for line in lines] == [
        "                      apart         predicted         held out",
        "  method               mrad     mm       mrad     mm      mrad     mm",
        "  maximum-likelihood  0.000  0.000      0.810  0.190     0.930  0.270",
        "  li                  0.100  0.020      0.900  0.200         -      -",
        "  andreff                 -      -          -      -         -      -",
        "",
        "  li: no held-out error: found 3",
        "  andreff: one axis\N{REPLACEMENT CHARACTER}[2J only",
        "",
    ]


def test_nothing_is_said_where_nothing_is_missing():
    assert len(shown(Comparison("li", 1e-4, 2e-5, 9e-4, 2e-4, 1e-3, 1e-4))) == 4
