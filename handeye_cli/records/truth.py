"""What a simulated recording was made from, which a user of a real one never has."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import FloatArray, ProvenanceStep


@dataclass(frozen=True)
class TrueStation:
    """A station as it really was.

    Attributes:
        name: Name of the station.
        base_T_gripper: (4, 4) where the robot was.
        camera_T_target: (4, 4) where the target was before the camera.
    """

    name: str
    base_T_gripper: FloatArray
    camera_T_target: FloatArray


@dataclass(frozen=True)
class Truth:
    """The true poses behind a recording, and what stands between them and what was recorded.

    Attributes:
        setup: Names mount and reference.
        mount_T_camera: (4, 4) true answer.
        reference_T_target: (4, 4) true constant, until a fault moves the target.
        stations: The stations, those whose pictures are missing too.
        seed: Of all noise.
        robot_rotation: Noise of the robot's poses, RMS angle, radians.
        robot_translation: The same of their positions, RMS distance, metres.
        image_noise: Standard deviation of a pixel, grey levels.
        blur_px: Standard deviation of the lens' blur, pixels.
        faults: What went wrong, as `--fault` names it.
        provenance: How the recording came about.
    """

    setup: Setup
    mount_T_camera: FloatArray
    reference_T_target: FloatArray
    stations: tuple[TrueStation, ...]
    seed: int
    robot_rotation: float
    robot_translation: float
    image_noise: float
    blur_px: float
    faults: tuple[str, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
