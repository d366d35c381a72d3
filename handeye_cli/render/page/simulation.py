"""Simulated calibrations, and the figures of the paper that they make."""

from __future__ import annotations

from handeye_cli.records import Simulation
from handeye_cli.render.figure_plot import figure_png
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import element, figure, image
from handeye_cli.render.simulation import show_simulation
from handeye_cli.reporting.contents import Contents

HEADING = "Simulation"


def body(contents: Contents, desk: Desk) -> str:
    """Return every simulation with its figures."""
    return "".join(
        element("div", _figures(each) + desk.teller.tell(show_simulation, each), "part")
        for each in contents.case.simulations
    )


def _figures(simulation: Simulation) -> str:
    drawn = ""
    for each in simulation.figures:
        words = f"Figure {each.number}: {each.ordinate} against {each.abscissa}"
        drawn += figure(image(figure_png(each, simulation), "png", words), words, "paper")
    return element("div", drawn, "figures")
