"""handeye: where a camera sits on a robot, from a recording, and how sure that is."""

__version__ = "0.1.0"
