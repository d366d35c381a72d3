"""A camera of few pixels before a small plate, so that a picture takes no time."""

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Camera, Noise, TargetSpec
from handeye_cli.simulate.faults import parse
from handeye_cli.simulate.recording import Rig, simulate_recording
from handeye_cli.simulate.render import Appearance

PLATE = TargetSpec("disc-grid", {"rows": 2, "columns": 3, "spacing_mm": 5, "diameter_mm": 4})
CENTRE = np.array([0.005, 0.0025, 0.0])
RIG = Rig(
    target=PLATE,
    camera=Camera(90, 80, 500.0, 500.0, 44.5, 39.5),
    mount_T_camera=se3.from_parts(
        rotations.exp(np.array([0.2, -0.3, 1.0])), np.array([0.1, -0.1, 0.15])
    ),
    reference_T_target=se3.from_parts(
        rotations.exp(np.array([3.0, 0.2, 0.1])), np.array([0.5, 0.1, 0.0])
    ),
    noise=Noise(robot_rotation=2e-4, robot_translation=5e-5),
    appearance=Appearance(noise=1.0),
)


def taken(rig: Rig = RIG, count: int = 4, seed: int = 1, faults=()):
    cameras = generate_stations(count, 0.2, 0.4, CENTRE)
    return simulate_recording(rig, cameras, seed, faults=[parse(fault) for fault in faults])
