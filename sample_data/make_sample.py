"""Make the sample recording: the paper's plate, seen from twelve stations of the paper's circle.

    python sample_data/make_sample.py

writes `paper-plate/` beside this file: `recording.yaml` with its images, which is what a user would
have, and `truth.yaml`, which a user would not. The same seed gives the same bytes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from handeye_cli import targets
from handeye_cli.conventions import MM, MRAD
from handeye_cli.geometry import rotations, se3
from handeye_cli.plan import plan
from handeye_cli.records import Camera, FloatArray, GreyImage, Noise, TargetSpec
from handeye_cli.simulate.recording import Rig, SimulatedRecording, simulate_recording
from handeye_cli.simulate.render import Appearance

FOLDER = Path(__file__).resolve().parent / "paper-plate"
SEED = 1989
CALIBRATION_STATIONS = 6
DISTANCE = 0.15
TILT = np.radians(30.0)
ROBOT_ROTATION_MRAD = 0.2
ROBOT_TRANSLATION_MM = 0.05
# The hand is turned about the camera's axis too, so the plate is not upright in every picture.
YAWS = np.radians([0, 25, -20, 35, -30, 10, -15, 20, -35, 30, 5, -25])

RIG = Rig(
    target=TargetSpec("disc-grid", {"rows": 6, "columns": 6, "spacing_mm": 5, "diameter_mm": 4}),
    camera=Camera(640, 480, 1250.0, 1247.5, 322.3, 237.1, (-0.12, 0.08, 0.0006, -0.0004, 0.0)),
    mount_T_camera=se3.from_parts(
        rotations.exp(np.array([0.35, -0.25, 1.4])), np.array([0.11, -0.12, 0.178])
    ),
    reference_T_target=se3.from_parts(
        rotations.exp(np.array([0.0, 0.0, 0.4])) @ rotations.exp(np.array([np.pi, 0.0, 0.0])),
        np.array([0.55, -0.12, 0.035]),
    ),
    noise=Noise(
        robot_rotation=ROBOT_ROTATION_MRAD * MRAD, robot_translation=ROBOT_TRANSLATION_MM * MM
    ),
    appearance=Appearance(gradient=(0.12, -0.08), noise=2.0),
)


def sample() -> SimulatedRecording:
    """Simulate the recording; its images are drawn when they are loaded."""
    planned = plan(
        CALIBRATION_STATIONS,
        distance=DISTANCE,
        tilt=TILT,
        centre=targets.build(RIG.target).points().mean(axis=0),
        verification=CALIBRATION_STATIONS,
    )
    cameras = np.stack([station.target_T_camera for station in planned.stations])
    turn = rotations.exp(YAWS[:, None] * np.array([0.0, 0.0, 1.0]))
    return simulate_recording(RIG, cameras @ se3.from_parts(turn, np.zeros(3)), SEED)


def recording_document(simulated: SimulatedRecording) -> dict[str, Any]:
    """Return what a user would have."""
    camera = RIG.camera
    names = ("width", "height", "fx", "fy", "cx", "cy")
    return {
        "schema": "handeye/recording/1",
        "setup": str(simulated.recording.setup),
        "target": {"type": RIG.target.type, **RIG.target.parameters},
        "camera": {name: getattr(camera, name) for name in names}
        | {"distortion": list(camera.distortion)},
        "stations": [
            {
                "name": station.name,
                "image": station.image.label,
                "base_T_gripper": pose_document(station.base_T_gripper),
            }
            for station in simulated.recording.stations
        ],
    }


def truth_document(simulated: SimulatedRecording) -> dict[str, Any]:
    """Return what the recording was made from."""
    names = [station.name for station in simulated.recording.stations]
    return {
        "seed": SEED,
        "noise": {
            "robot_rotation_mrad": ROBOT_ROTATION_MRAD,
            "robot_translation_mm": ROBOT_TRANSLATION_MM,
            "image_grey_levels": RIG.appearance.noise,
        },
        "blur_px": RIG.appearance.blur_px,
        "gripper_T_camera": pose_document(simulated.mount_T_camera),
        "base_T_target": pose_document(simulated.reference_T_target),
        "stations": [
            {"name": name, "camera_T_target": pose_document(pose)}
            for name, pose in zip(names, simulated.camera_T_target, strict=True)
        ],
    }


def pose_document(pose: FloatArray) -> dict[str, list[float]]:
    """Return a pose to the nanometre and the nanoradian."""
    quaternion = rotations.quaternion_from_matrix(pose[:3, :3])
    return {
        "translation": [round(float(x), 9) for x in pose[:3, 3]],
        "quaternion": [round(float(x), 10) for x in quaternion],
    }


def png(image: GreyImage) -> bytes:
    """Return an image as a PNG file, compressed as far as OpenCV does."""
    _, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return data.tobytes()


def write(folder: Path) -> None:
    """Write the documents and the images."""
    simulated = sample()
    (folder / "images").mkdir(parents=True, exist_ok=True)
    documents = {
        "recording.yaml": recording_document(simulated),
        "truth.yaml": truth_document(simulated),
    }
    for name, document in documents.items():
        text = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=100)
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    for station in simulated.recording.stations:
        (folder / station.image.label).write_bytes(png(station.image.load()))


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
