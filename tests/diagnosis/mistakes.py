"""Classic mistakes in a stations document whose truth is known, and scenes to make them in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scenes import PAPER_DISTANCE, Scene, general_scene, scene, stations, unit
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Noise, UncertainPose
from handeye_cli.records.line import WrittenRotation

QUIET = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def of_cameras(rng, cameras):
    """A scene with these poses target_T_camera and a random answer."""
    base = scene(rng, 3)
    A = base.Z @ cameras @ se3.inverse(base.X)
    return Scene(A, se3.inverse(cameras), base.X, base.Z)


def driven_circle(rng, count, tilt_deg=30.0):
    """The paper's circle as a robot is driven to it by hand: 4 degrees, 10 mm, a tenth in height.

    On the perfect circle poses the other way round, shifted lists and any size of the target fit.
    """
    cameras = generate_stations(count, PAPER_DISTANCE, np.radians(tilt_deg))
    aside = np.concatenate(
        [0.01 * rng.normal(size=(count, 3)), 0.07 * rng.normal(size=(count, 3))], 1
    )
    cameras = se3.perturb(cameras, aside)
    cameras[:, :3, 3] *= rng.uniform(0.9, 1.1, size=(count, 1))
    return of_cameras(rng, cameras)


def near_planar(rng, count, tilt_deg=15.0):
    """Small rotations about axes that nearly lie in one plane."""
    turns = np.radians(tilt_deg) * rng.uniform(-1.0, 1.0, size=(count, 3)) * [1.0, 1.0, 0.1]
    away = np.concatenate(
        [0.05 * rng.normal(size=(count, 2)), rng.uniform(0.3, 0.6, (count, 1))], 1
    )
    return of_cameras(rng, se3.inverse(se3.from_parts(rotations.exp(turns), away)))


def one_axis(rng, count):
    """Rotations about one axis, and any translations."""
    turns = rng.uniform(-1.0, 1.0, (count, 1)) * unit(rng)
    return of_cameras(rng, se3.from_parts(rotations.exp(turns), 0.2 * rng.normal(size=(count, 3))))


def with_half_turns(rng, count):
    """Every second station is the one before it, turned about the viewing axis by 180 degrees."""
    cameras = se3.inverse(general_scene(rng, count).B)
    cameras[1::2, :3, :3] = cameras[: len(cameras[1::2]) * 2 : 2, :3, :3] @ np.diag([-1.0, -1, 1])
    return of_cameras(rng, cameras)


def recording(rng, perfect, noise=QUIET, setup=Setup.EYE_IN_HAND):
    return stations(rng, perfect, noise, setup=setup, with_covariance=False)


def robot(document):
    return np.array([station.base_T_gripper for station in document.stations])


def camera(document):
    return np.array([station.camera_T_target.matrix for station in document.stations])


def with_robot(document, poses, written=None):
    written = [None] * len(poses) if written is None else written
    rows = zip(document.stations, poses, written, strict=True)
    changed = (replace(station, base_T_gripper=P, written=w) for station, P, w in rows)
    return replace(document, stations=tuple(changed))


def with_camera(document, poses):
    rows = zip(document.stations, poses, strict=True)
    changed = (replace(station, camera_T_target=UncertainPose(P)) for station, P in rows)
    return replace(document, stations=tuple(changed))


def inverted(document):
    return with_robot(document, se3.inverse(robot(document)))


def other_mounting(document):
    eye_in_hand = document.setup is Setup.EYE_IN_HAND
    return replace(document, setup=Setup.EYE_TO_HAND if eye_in_hand else Setup.EYE_IN_HAND)


def read_as_xyzw(poses):
    """What becomes of quaternions w x y z that are read as x y z w, by SciPy."""
    quaternions = np.roll(Rotation.from_matrix(poses[:, :3, :3]).as_quat(), 1, axis=1)
    return se3.from_parts(Rotation.from_quat(quaternions).as_matrix(), poses[:, :3, 3])


def robot_wxyz(document):
    return with_robot(document, read_as_xyzw(robot(document)))


def all_wxyz(document):
    return with_camera(robot_wxyz(document), read_as_xyzw(camera(document)))


def inverted_wxyz(document):
    return robot_wxyz(inverted(document))


def euler(document, true="ZYX", said="xyz", *, true_degrees=True, said_degrees=True):
    """Robot poses written as Euler angles in one way and read in another, by SciPy."""
    poses = robot(document)
    numbers = Rotation.from_matrix(poses[:, :3, :3]).as_euler(true, degrees=true_degrees)
    read = Rotation.from_euler(said, numbers, degrees=said_degrees).as_matrix()
    written = [
        WrittenRotation(euler=tuple(each.tolist()), order=said, degrees=said_degrees)
        for each in numbers
    ]
    return with_robot(document, se3.from_parts(read, poses[:, :3, 3]), written)


def degrees_as_radians(document):
    return euler(document, "xyz", "xyz", true_degrees=True, said_degrees=False)


def radians_as_degrees(document):
    return euler(document, "xyz", "xyz", true_degrees=False, said_degrees=True)


def scaled(poses, factor):
    return se3.from_parts(poses[:, :3, :3], factor * poses[:, :3, 3])


def robot_in(document, units_per_metre):
    return with_robot(document, scaled(robot(document), units_per_metre))


def in_millimetres(document):
    return robot_in(document, 1000.0)


def all_in_millimetres(document):
    return with_camera(in_millimetres(document), scaled(camera(document), 1000.0))


def board_too_small(document):
    """The target is 1.25 times as large as was declared."""
    return with_camera(document, scaled(camera(document), 1.0 / 1.25))


def shifted(document, places=1):
    """The list of robot poses lacks its first ones."""
    shorter = replace(document, stations=document.stations[:-places])
    return with_robot(shorter, robot(document)[places:])


def lost_picture(document, at=4):
    """The list of target poses lacks one, and all that follow are shifted."""
    shorter = replace(document, stations=document.stations[:-1])
    return with_camera(shorter, np.delete(camera(document), at, axis=0))


def mirrored(document):
    """The robot's frames have their y axis the other way."""
    poses, flip = robot(document), np.diag([1.0, -1.0, 1.0, 1.0])
    return with_robot(document, flip @ poses @ flip)
