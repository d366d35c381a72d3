"""What a simulated recording was made from, and what of it is not in the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handeye_cli.records import Finding, Noise, ProvenanceStep
from handeye_cli.records.truth import TrueStation, Truth
from handeye_cli.simulate.faults import Fault
from handeye_cli.simulate.recording import SimulatedRecording


def truth_of(
    simulated: SimulatedRecording,
    noise: Noise,
    faults: Sequence[Fault] = (),
    provenance: tuple[ProvenanceStep, ...] = (),
) -> Truth:
    """Return the true poses, and what stands between them and the recording.

    Args:
        simulated: The recording.
        noise: Of its robot.
        faults: What went wrong.
        provenance: How the recording came about.
    """
    appearance = simulated.scene.appearance
    poses = zip(
        simulated.staging.names, simulated.base_T_gripper, simulated.camera_T_target, strict=True
    )
    return Truth(
        setup=simulated.recording.setup,
        mount_T_camera=simulated.mount_T_camera,
        reference_T_target=simulated.reference_T_target,
        stations=tuple(TrueStation(name, robot, target) for name, robot, target in poses),
        seed=simulated.seed,
        robot_rotation=noise.robot_rotation or 0.0,
        robot_translation=noise.robot_translation or 0.0,
        image_noise=appearance.noise,
        blur_px=appearance.blur_px,
        faults=tuple(fault.text for fault in faults),
        provenance=provenance,
    )


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
