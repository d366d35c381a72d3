"""What times that are off make of poses, at pauses and in motion."""

from dataclasses import replace

import numpy as np
from scenes import general_scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.diagnosis.late_poses import late_poses
from handeye_cli.records import Noise


def test_a_pause_among_frames_in_motion_has_no_scatter():
    rng = np.random.default_rng(1)
    chain = chain_of(stations(rng, general_scene(rng, 6), Noise(2e-4, 5e-5, 1e-4, 1e-4)))
    way = rng.normal(size=(6, 6)) * 1e-4
    way[[0, 3]] = 0.0
    scatter = 4.0 * way[:, :, None] * way[:, None, :]
    late = late_poses(replace(chain, robot_covariance=scatter, shared_error=way))
    np.testing.assert_allclose(late.scatter, scatter, rtol=1e-9, atol=1e-30)
    np.testing.assert_array_equal(late.scatter[[0, 3]], 0.0)
