"""The answer as far as the stations determine it, for robots that turn about one axis or none.

Four degrees of freedom (SCARA) leave the translation along their axis open whatever they do; the
rest of the answer is as good as any.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.held import estimate_held, linearised
from handeye_cli.diagnosis.undetermined import named
from handeye_cli.errors import ConvergenceError
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.whitened_loop import least_squares
from handeye_cli.predict import noise_freedom, predicted_error, solution_covariance
from handeye_cli.records import FloatArray, PartialAnswer, Stations, UncertainPose


def solve_partial(
    stations: Stations, chain: Chain, *, near: FloatArray | None = None
) -> PartialAnswer:
    """Estimate the determined part of the answer by maximum likelihood from the stations' poses.

    What is not determined is held as near to a guess as the determined part allows: a free
    translation is that of the guess along its direction, a free rotation the nearest to its
    rotation. Where all is determined the answer is that of `maximum-likelihood`.

    Args:
        stations: The document, for its setup and its given noise.
        chain: Its usable stations; one or two will do.
        near: (4, 4) guess of mount_T_camera, such as from a drawing; the identity when not given.

    Raises:
        UndeterminedError: A single station without given noise.
        ConvergenceError: The estimation did not settle.
    """
    found = estimate_held(chain, stations.noise, near=near)
    if not found.converged:
        raise ConvergenceError(
            f"the estimation of the determined part did not settle on {len(chain.A)} stations",
            hint="give the noise levels under 'noise' in the document",
        )
    solution, model = found.solution, found.model
    loops = linearised(chain, solution, model.covariance)
    _, influence = least_squares(loops, found.free.basis, np.zeros(12))
    caused = chain.caused(influence)
    shared = caused @ caused.T
    covariance = solution_covariance(influence, model.covariance) + shared
    estimated = len(model.shapes) > 0
    return PartialAnswer(
        setup=stations.setup,
        mount_T_camera=UncertainPose(solution.X, covariance[:6, :6]),
        reference_T_target=UncertainPose(solution.Z, covariance[6:, 6:]),
        covariance=covariance,
        free=named(found.free, stations.setup),
        predicted_error=predicted_error(influence, model, None, shared),
        noise=model.noise,
        noise_estimated=estimated,
        noise_freedom=noise_freedom(chain, solution, model) if estimated else None,
        residuals=loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals,
    )
