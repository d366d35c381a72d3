"""What the flags of `handeye simulate recording` ask for, with the documents that they name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from handeye_cli.cli.checks import distance_of
from handeye_cli.cli.grouping import given
from handeye_cli.cli.inputs import Opened, open_calibration
from handeye_cli.cli.simulate_recording_options import (
    MOST_PIXELS,
    Disturbance,
    Optics,
    Scenery,
)
from handeye_cli.conventions import Setup, parse_angle, parse_length
from handeye_cli.errors import InputError, UsageError

if TYPE_CHECKING:
    from handeye_cli.records import Camera, FloatArray, Noise
    from handeye_cli.simulate.faults import Fault
    from handeye_cli.simulate.recording import Rig, SimulatedRecording

_COEFFICIENTS = (4, 5)
_MOST_GRADIENT = 2.0
_OF_PLAN = ("stations", "distance", "tilt")
_OF_CAMERA = ("width", "height", "focal-px", "distortion")


@dataclass(frozen=True)
class Wish:
    """A recording that is wanted.

    Attributes:
        rig: What stays as it is over all stations.
        target_T_camera: (N, 4, 4) places of the camera.
        names: Of the stations.
        seed: Of all noise.
        faults: What goes wrong.
        inputs: The documents that were read.
    """

    rig: Rig
    target_T_camera: FloatArray
    names: list[str]
    seed: int
    faults: list[Fault]
    inputs: list[Opened]

    def simulated(self) -> SimulatedRecording:
        """Return the recording; its pictures are not drawn yet.

        Raises:
            UsageError: A fault names a station that is not there.
        """
        from handeye_cli.simulate.recording import simulate_recording

        return simulate_recording(
            self.rig, self.target_T_camera, self.seed, names=self.names, faults=self.faults
        )


def wish_of(scenery: Scenery, optics: Optics, chance: Disturbance) -> Wish:
    """Return what the flags ask for.

    Raises:
        UsageError: A flag is not understood, or another one takes its effect away.
        InputError: A document cannot be read, or is not of the kind that its flag wants.
    """
    from handeye_cli import targets
    from handeye_cli.simulate import default_rig, faults
    from handeye_cli.simulate.recording import Rig
    from handeye_cli.simulate.render import Appearance

    wrong = [faults.parse(text) for text in scenery.fault or ()]
    target = targets.parse(scenery.target or default_rig.TARGET)
    camera, of_camera = _camera(optics)
    calibration = open_calibration(scenery.calibration)
    planned = _plan(scenery, camera, targets.build(target).points())
    setup = _setup(scenery, calibration, planned)
    mount_T_camera, reference_T_target = _true_poses(calibration, setup)
    rig = Rig(
        target=target,
        camera=camera,
        mount_T_camera=mount_T_camera,
        reference_T_target=reference_T_target,
        setup=setup,
        noise=_noise(chance),
        appearance=Appearance(
            gradient=_gradient(chance.gradient), blur_px=chance.blur_px, noise=chance.image_noise
        ),
    )
    opened = [each for each in (planned.opened, calibration, of_camera) if each is not None]
    return Wish(rig, planned.target_T_camera, planned.names, chance.seed, wrong, opened)


@dataclass(frozen=True)
class _Planned:
    target_T_camera: FloatArray
    names: list[str]
    setup: Setup
    opened: Opened | None


def _plan(scenery: Scenery, camera: Camera, points: FloatArray) -> _Planned:
    """Return the stations of the plan's document, or of the paper's circle around the target."""
    import numpy as np

    from handeye_cli import pipeline
    from handeye_cli.geometry.extent import middle_of
    from handeye_cli.plan import plan
    from handeye_cli.records import Plan
    from handeye_cli.simulate.default_rig import filling_distance

    opened = None if scenery.plan is None else _opened(scenery.plan)
    if opened is not None:
        _refuse_beside("--plan", scenery, _OF_PLAN)
        with opened.blamed():
            pipeline.expect(opened.record, Plan)
        planned = opened.record
    else:
        wanted = scenery.distance
        planned = plan(
            scenery.stations,
            distance=filling_distance(points, camera) if wanted is None else distance_of(wanted),
            tilt=parse_angle(scenery.tilt),
            setup=scenery.setup or Setup.EYE_IN_HAND,
            centre=middle_of(points),
        )
    places = np.stack([station.target_T_camera for station in planned.stations])
    return _Planned(places, [station.name for station in planned.stations], planned.setup, opened)


def _setup(scenery: Scenery, calibration: Opened | None, planned: _Planned) -> Setup:
    if calibration is None:
        return scenery.setup or planned.setup
    setup: Setup = calibration.record.setup
    if scenery.setup not in (None, setup):
        raise UsageError(f"--setup is {scenery.setup}, but the calibration is {setup}")
    return setup


def _true_poses(calibration: Opened | None, setup: Setup) -> tuple[FloatArray, FloatArray]:
    from handeye_cli.simulate import default_rig

    if calibration is None:
        return default_rig.mount_T_camera(setup), default_rig.reference_T_target(setup)
    record = calibration.record
    return record.mount_T_camera.matrix, record.reference_T_target.matrix


def _noise(chance: Disturbance) -> Noise:
    from handeye_cli.records import Noise

    return Noise(
        robot_rotation=_level("--robot-rotation", chance.robot_rotation, parse_angle),
        robot_translation=_level("--robot-translation", chance.robot_translation, parse_length),
    )


def _level(flag: str, text: str, parse: Callable[[str], float]) -> float:
    level = parse(text)
    if level < 0.0:
        raise UsageError(f"expected a noise of 0 or more, found {text!r}", where=flag)
    return level


def _camera(optics: Optics) -> tuple[Camera, Opened | None]:
    from handeye_cli.records import Camera

    if optics.camera is not None:
        return _camera_of_file(optics, optics.camera)
    focal = optics.focal_px
    middle = ((optics.width - 1) / 2.0, (optics.height - 1) / 2.0)
    distortion = _distortion(optics.distortion)
    return Camera(optics.width, optics.height, focal, focal, *middle, distortion), None


def _camera_of_file(optics: Optics, path: str) -> tuple[Camera, Opened]:
    from handeye_cli.documents import cameras

    _refuse_beside("--camera", optics, _OF_CAMERA)
    read = cameras.read(path, None)
    width, height = read.camera.width, read.camera.height
    if max(width, height) > MOST_PIXELS:
        raise InputError(
            f"expected images of at most {MOST_PIXELS} columns and rows, found {width} x {height}",
            where=read.name,
        )
    # What is simulated is known exactly, however it was found.
    return replace(read.camera, covariance=None), Opened(read.camera, (read.name, read.sha256))


def _distortion(text: str | None) -> tuple[float, ...]:
    numbers = () if text is None else _numbers(text)
    if text is not None and len(numbers) not in _COEFFICIENTS:
        raise UsageError(
            f"expected four or five numbers with commas, found {text!r}",
            where="--distortion",
            hint="write k1,k2,p1,p2,k3, such as -0.12,0.08,0,0,0",
        )
    return numbers


def _gradient(text: str | None) -> tuple[float, float]:
    numbers = (0.0, 0.0) if text is None else _numbers(text)
    # Half of each change lies to either side of the middle; beyond that a corner has no light.
    if len(numbers) != 2 or not sum(map(abs, numbers)) < _MOST_GRADIENT:
        raise UsageError(
            f"expected two numbers whose sizes add up to less than {_MOST_GRADIENT:g}, "
            f"found {text!r}",
            where="--gradient",
            hint="write the changes to the right and down, such as 0.12,-0.08",
        )
    return numbers


def _numbers(text: str) -> tuple[float, ...]:
    """Return the numbers of a list with commas, none if one of its words is no number."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        return ()


def _opened(path: str) -> Opened:
    from handeye_cli import documents

    read = documents.read_source(path)
    return Opened(read.record, (read.name, read.sha256))


def _refuse_beside(flag: str, group: Any, names: tuple[str, ...]) -> None:
    for name in (each for each in names if each in given(group)):
        raise UsageError(
            f"--{name} has no effect beside {flag}, which says it already", hint="leave one out"
        )
