"""The report of a robot's recording."""

import io

from handeye_cli.conventions import Setup
from handeye_cli.records import Camera, Finding, Inspection
from handeye_cli.records.recording_summary import (
    LinkSummary,
    MissingFlag,
    Motion,
    PauseSummary,
    RecordingSummary,
    TopicSummary,
    UsedParts,
)
from handeye_cli.render.console import make_console
from handeye_cli.render.report import show

CAMERA = Camera(640, 480, 550.0, 551.0, 320.5, 240.5)
SUMMARY = RecordingSummary(
    duration=12.34,
    cut=True,
    topics=(
        TopicSummary("/camera/image", "sensor_msgs/msg/Image", "cdr", 240, 20.0, "image"),
        TopicSummary("/tf_static", "tf2_msgs/msg/TFMessage", "cdr", 1, None, "transforms"),
        TopicSummary("/x", "", "json", 0),
    ),
    links=(
        LinkSummary("arm", "wrist", Motion.MOVING, 90),
        LinkSummary("base", "arm", Motion.MOVING, 91),
        LinkSummary("base", "stand", Motion.STATIC, 1),
        LinkSummary("wrist", "camera", Motion.STATIC, 1),
    ),
    pauses=(PauseSummary(0.1, 0.92, 18), PauseSummary(3.0, 1.0, 0)),
    ready=False,
    used=UsedParts("/camera/image", "/info", CAMERA, None, None, ("base", "arm", "wrist"), "log"),
    missing=(MissingFlag("--setup", ("eye-in-hand", "eye-to-hand")), MissingFlag("--target")),
    command="handeye solve a.mcap --setup WHERE --target SPEC",
)
EXPECTED = """\
This recording can be read

Topics of the recording (12.3 s, its end is missing)
                                         rate
  topic                           count    Hz  use
  /camera/image
    sensor_msgs/msg/Image (cdr)     240  20.0  image
  /tf_static
    tf2_msgs/msg/TFMessage (cdr)      1     -  transforms
  /x
    - (json)                          0     -

Frames
  base
    arm (moving, 91)
      wrist (moving, 90)
        camera (static, 1)
    stand (static, 1)

2 pauses of the robot, 1 with images
  start  length
      s       s  images
    0.1    0.92      18
    3.0    1.00       0

What is used

  images      /camera/image
  intrinsics  /info: 640x480, focal 550.0 551.0 px, centre 320.5 240.5,
              plumb_bob
  robot       base -> arm -> wrist
  clock       log

To calibrate from it, fill in and run
  handeye solve a.mcap --setup WHERE --target SPEC
  --setup: eye-in-hand or eye-to-hand
  --target: such as chessboard:9x6:23.6mm or disc-grid:6x6:5mm:4mm

"""


def printed(inspection):
    stream = io.StringIO()
    console = make_console(stream)
    console.width = 80
    show(inspection, console)
    return "".join(f"{line.rstrip()}\n" for line in stream.getvalue().splitlines())


def inspection(**changes):
    plain = vars(SUMMARY) | changes
    return Inspection(setup=None, stations=(), recording=RecordingSummary(**plain))


def test_report_of_a_recording():
    text = printed(inspection())
    assert text.rstrip() == EXPECTED.rstrip()


def test_what_is_not_known_is_a_dash_and_the_verdict_follows_the_errors():
    plain = inspection(used=UsedParts(), links=(), pauses=())
    error = Finding("no-images", "error", "expected an image topic, found /x", "record one")
    text = printed(Inspection(Setup.EYE_IN_HAND, (), (error,), recording=plain.recording))
    assert text.startswith("This recording cannot be read as it is (eye-in-hand)\n\n")
    assert "images      -" in text
    assert "Frames" not in text


def test_frames_that_form_a_loop_or_have_two_parents_are_shown_once_more_and_no_further():
    loop = (
        LinkSummary("a", "b", Motion.MOVING, 1),
        LinkSummary("b", "a", Motion.MOVING, 2),
        LinkSummary("c", "b", Motion.STATIC, 3),
    )
    text = printed(inspection(links=loop))
    lines = text[text.index("Frames") : text.index("pauses")].splitlines()
    assert lines[1:5] == [
        "  c",
        "    b (static, 3)",
        "      a (moving, 2)",
        "        b (moving, 1)",
    ]
    assert printed(inspection(links=loop[:2])).count("moving, 1") == 1


def test_many_pauses_are_not_all_listed():
    text = printed(inspection(pauses=(PauseSummary(0.0, 1.0, 3),) * 50))
    assert "50 pauses of the robot, 50 with images" in text
    assert "and 10 more" in text


def test_names_obey_no_terminal():
    odd = (LinkSummary("base", "\x1b[2J", Motion.STATIC, 1),)
    assert "\x1b" not in printed(inspection(links=odd, command="handeye \x1b[2J"))
