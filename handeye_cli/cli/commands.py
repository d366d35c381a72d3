"""The commands: where each is, and the line that the list of all says of it.

The list is written without loading the commands, so their summaries stand here as well; a test
keeps them the first paragraphs of the docstrings.
"""

COMMANDS = {
    "import": "handeye_cli.cli.import_",
    "extract": "handeye_cli.cli.extract",
    "extrinsics": "handeye_cli.cli.extrinsics",
    "solve": "handeye_cli.cli.solve",
    "verify": "handeye_cli.cli.verify",
    "batch": "handeye_cli.cli.batch",
    "export": "handeye_cli.cli.export",
    "inspect": "handeye_cli.cli.inspect",
    "report": "handeye_cli.cli.report",
    "plan": "handeye_cli.cli.plan",
    "simulate": "handeye_cli.cli.simulate",
    "simulate recording": "handeye_cli.cli.simulate_recording",
}
"""Every command in the order of the help, with the module that holds a function of its name."""

SUMMARIES = {
    "import": "Read the data of another tool, and write them as a recording or stations document.",
    "extract": "Find the calibration target's points in the pictures of a recording.",
    "extrinsics": "Compute the pose of the target in the camera at every station, with its "
    "covariance.",
    "solve": "Calibrate: find the camera's pose on the gripper (or on the base) and its expected "
    "error.",
    "verify": "Measure the error of a calibration on stations that took no part in it.",
    "batch": "Solve and verify many recordings, each on its own, and list what came of them.",
    "export": "Write where the camera sits for ROS, URDF, OpenCV and others, between frames with "
    "names.",
    "inspect": "Look at the data before or instead of a calibration, and say what is wrong with "
    "them.",
    "report": "Write one page that anybody can open: the answer, a traffic light, tables and "
    "pictures.",
    "plan": "Lay out stations that calibrate well: the paper's circle of tilted views of the "
    "target.",
    "simulate": "Calibrate simulated stations again and again, and count how far off the answers "
    "are.",
    "simulate recording": "Make a recording whose truth is known: rendered pictures, and the "
    "poses of a noisy robot.",
}
"""What each command does, in a sentence."""
