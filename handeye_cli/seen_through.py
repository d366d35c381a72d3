"""The target's poses once more, from the same pixels through other intrinsics.

A calibration that refines uncertain intrinsics belongs to the refined ones: with the pose of the
camera on its mount they are what it hands on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.records import Camera, FloatArray, IntArray, Stations, UncertainPose


def chain_through(stations: Stations, chain: Chain, camera: Camera | None) -> Chain:
    """Return a chain as another camera sees it; the same one where nothing is known to change.

    Args:
        stations: The document the chain is from.
        chain: Some of its stations.
        camera: The intrinsics to see through; the document's own where they were not refined.
    """
    if camera is None or camera is stations.camera or not chain.by_intrinsics.shape[-1]:
        return chain
    return replace(chain, B=_poses(stations, chain.index, chain.B, camera))


def stations_through(stations: Stations, camera: Camera | None) -> Stations:
    """Return stations as a calibration's camera sees them, where its intrinsics were uncertain.

    Args:
        stations: New stations; those with pixels are seen through the camera if it is the same
            kind: image size and model.
        camera: The intrinsics of the calibration.
    """
    seen = [i for i, each in enumerate(stations.stations) if each.camera_T_target is not None]
    pixels = all(stations.stations[i].observation is not None for i in seen)
    if stations.target is None or not pixels or not _refines(camera, stations.camera):
        return stations
    assert camera is not None
    entries = list(stations.stations)
    given = [entries[i].camera_T_target or UncertainPose(np.eye(4)) for i in seen]
    start = np.array([each.matrix for each in given]).reshape(-1, 4, 4)
    poses = _poses(stations, np.array(seen, dtype=np.int64), start, camera)
    for i, pose, before in zip(seen, poses, given, strict=True):
        entries[i] = replace(entries[i], camera_T_target=replace(before, matrix=pose))
    return replace(stations, stations=tuple(entries), camera=camera)


def _refines(camera: Camera | None, other: Camera | None) -> bool:
    if camera is None or other is None or camera.covariance is None:
        return False
    return (camera.width, camera.height, camera.model) == (other.width, other.height, other.model)


def _poses(stations: Stations, index: IntArray, start: FloatArray, camera: Camera) -> FloatArray:
    """Return the (M, 4, 4) poses that explain the pixels of some stations best."""
    from handeye_cli import targets
    from handeye_cli.geometry import pnp
    from handeye_cli.views import views_of

    assert stations.target is not None
    chosen = tuple(stations.stations[i] for i in index)
    views = views_of(chosen, targets.build(stations.target).points())
    poses = start.copy()
    poses[views.index], _ = pnp.refine(start[views.index], views.seen, camera.lens)
    return poses
