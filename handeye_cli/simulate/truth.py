"""What a recording was made from: the document that a user of a real one never has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from handeye_cli.conventions import MM, MRAD
from handeye_cli.documents.poses import data_from_matrix
from handeye_cli.records import Finding, Noise
from handeye_cli.simulate.faults import Fault
from handeye_cli.simulate.recording import SimulatedRecording


def truth_document(
    simulated: SimulatedRecording, noise: Noise, faults: Sequence[Fault] = ()
) -> dict[str, Any]:
    """Return the true poses, and what stands between them and the recording, as plain data.

    Args:
        simulated: The recording.
        noise: Of its robot.
        faults: What went wrong.
    """
    setup, scene = simulated.recording.setup, simulated.scene
    poses = zip(
        simulated.staging.names, simulated.base_T_gripper, simulated.camera_T_target, strict=True
    )
    return {
        "seed": simulated.seed,
        "setup": str(setup),
        "noise": {
            "robot_rotation_mrad": (noise.robot_rotation or 0.0) / MRAD,
            "robot_translation_mm": (noise.robot_translation or 0.0) / MM,
            "image_grey_levels": scene.appearance.noise,
        },
        "blur_px": scene.appearance.blur_px,
        "faults": [fault.text for fault in faults],
        setup.answer: data_from_matrix(simulated.mount_T_camera),
        setup.constant: data_from_matrix(simulated.reference_T_target),
        "stations": [
            {
                "name": name,
                "base_T_gripper": data_from_matrix(robot),
                "camera_T_target": data_from_matrix(target),
            }
            for name, robot, target in poses
        ],
    }


def out_of_view(simulated: SimulatedRecording) -> Finding | None:
    """Return a warning that names the stations that do not see the whole target, or None."""
    camera = simulated.scene.camera
    pixels = simulated.scene.pixels(simulated.camera_T_target)
    last = np.array([camera.width, camera.height]) - 1.0
    inside = np.all((pixels >= 0.0) & (pixels <= last), axis=(-2, -1))
    names = [name for name, whole in zip(simulated.staging.names, inside, strict=True) if not whole]
    if not names:
        return None
    return Finding(
        "target-out-of-view",
        "warning",
        f"the target is not wholly in the picture at {len(names)} of {len(inside)} stations: "
        + ", ".join(names),
        "take a larger --distance, a smaller --tilt or a plan made for this --target",
    )
