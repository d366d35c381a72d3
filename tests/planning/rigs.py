"""Rigs and cells for the tests of planning."""

from functools import partial

import numpy as np

from handeye_cli.conventions import MIL, MRAD, Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.planning import views
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.levels import suppose
from handeye_cli.planning.limits import cell_of
from handeye_cli.planning.options import Limits, PlanOptions
from handeye_cli.planning.prediction import UncertainRig
from handeye_cli.records import Camera, Noise

NOISE = Noise(1.5 * MRAD, 5.0 * MIL, 1.5 * MRAD, 3.0 * MIL)
DISTANCE, TILT = 6.65 * 0.0254, np.radians(30.0)
CAMERA = Camera(640, 480, 1250.0, 1250.0, 319.5, 239.5)
PLATE = np.stack([*np.meshgrid(np.arange(6) * 0.005, np.arange(6) * 0.005), np.zeros((6, 6))], -1)
PLATE = PLATE.reshape(-1, 3)
AIM = np.array([0.0125, 0.0125, 0.0])
X = se3.from_parts(rotations.exp(np.array([0.1, -0.2, 1.5])), np.array([0.05, -0.03, 0.12]))
Z = se3.from_parts(rotations.exp(np.array([3.0, 0.2, 0.1])), np.array([0.6, 0.1, 0.05]))
FRAMES = Frames(Setup.EYE_IN_HAND, X, Z)


def rig(setup=Setup.EYE_IN_HAND, X=X, Z=Z, noise=NOISE):
    robot = isotropic_covariance(noise.robot_rotation, noise.robot_translation)
    camera = isotropic_covariance(noise.camera_rotation, noise.camera_translation)
    return UncertainRig(setup, X[None], Z[None], robot, camera)


def unknown_rig(setup=Setup.EYE_IN_HAND, **options):
    return suppose(Frames(setup), PlanOptions(**options)).rig


def circle(count, distance=DISTANCE, tilt=TILT):
    return views.circle_views(2 * np.pi * np.arange(count) / count, distance, tilt)


def cell(frames=FRAMES, distance=(DISTANCE, DISTANCE), sees=True, **limits):
    return cell_of(
        Limits(**limits),
        frames,
        cameras_of=partial(views.cameras_of, aim=AIM),
        aim=AIM,
        distance=distance,
        points=PLATE if sees else None,
        camera=CAMERA if sees else None,
    )
