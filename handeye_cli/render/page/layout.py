"""Where the robot went, and which way it turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.figures.axis_disc import draw_axes
from handeye_cli.render.page.figures.scene import draw_scene
from handeye_cli.render.page.markup import element, figure
from handeye_cli.reporting.axis_coverage import AxisCoverage
from handeye_cli.reporting.contents import Contents
from handeye_cli.reporting.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADING = "Stations"

_SIZE = (4.6, 4.1)
"""Width and height of a figure, inches: small, so that its letters are large on a phone."""
_FRAMES = {"base": "the robot's base", "target": "the target"}


def body(contents: Contents, desk: Desk) -> str:
    """Return the picture in space, and the axes of the rotations between stations."""
    shown = "" if contents.scene is None else scene_figure(contents.scene, desk)
    if contents.axes is not None and len(contents.axes.places):
        shown += _axes_figure(contents.axes, desk)
    return element("div", shown, "figures")


def scene_figure(scene: Scene, desk: Desk) -> str:
    """Return stations in space with their caption."""

    def act(sheet: Figure) -> None:
        # over the whole sheet: the corners of a box in space leave room enough
        sheet.set_layout_engine("none")
        draw_scene(sheet.add_axes((-0.08, 0.01, 1.06, 1.03), projection="3d"), scene)

    what = "Cameras and plate" if len(scene.plates) == 1 else "Camera and plates"
    words = f"{what} in the frame of {_FRAMES[scene.frame]}"
    bars = "; bars join the pairs of stations that the closed form uses" if len(scene.pairs) else ""
    some = "" if scene.total == len(scene.names) else f"; {len(scene.names)} of {scene.total}"
    robot = ", grippers in thin lines" if len(scene.grippers) else ""
    return figure(desk.pen.draw(act, _SIZE, words), f"{words}{robot}{bars}{some}.")


def _axes_figure(axes: AxisCoverage, desk: Desk) -> str:
    def act(sheet: Figure) -> None:
        draw_axes(sheet.add_subplot(), axes)

    words = f"Axes of the rotations between stations, in the frame of the {axes.frame}"
    caption = (
        f"{words}, seen from above its z axis; large dots are large rotations, and an answer is "
        "as good as the axes are apart."
    )
    return figure(desk.pen.draw(act, _SIZE, words), caption)
