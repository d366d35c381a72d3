"""Solving: accuracy against the Cramer-Rao bound, time and memory against the number of stations.

This project beside OpenCV 4, where it is installed: OpenCV 5 has no hand-eye calibration. Times of
a process include that of its children and are those of the processor, medians of alternating runs.

    python benchmarks/solve.py
    python benchmarks/solve.py --part accuracy --trials 2000 --seed 2
    python benchmarks/solve.py --part time --largest 8000
    python benchmarks/solve.py --part process --runs 41
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from handeye_cli import Noise, Setup, solve_batch, solve_poses, solvers, write
from handeye_cli.geometry import rotations, se3, star
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.predict import solution_covariance
from handeye_cli.records import Station, Stations, UncertainPose
from handeye_cli.solvers import Problem, Solution

INCH, MIL = 0.0254, 25.4e-6
NOISE = Noise(1.5e-3, 5 * MIL, 1.5e-3, 3 * MIL)
DEEP = np.diag([0.03, 0.03, 0.3, 1.5, 1.5, 0.2]) * 1e-3
"""Sigmas (m, rad) of a camera's pose as its extrinsics are: depth and tilt are the worst."""
HAND_EYE = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")
ROBOT_WORLD = ("SHAH", "LI")
HAS_OPENCV = hasattr(cv2, "calibrateHandEye")
ONE_THREAD = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Else threads that wait for each other are counted as work."""
SLOWEST = 20.0
"""Seconds that one call of OpenCV may take; larger numbers of stations are left out."""


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def paper_layout(rng, count):
    """The base setting of the paper's simulation; both noises are isotropic."""
    B = se3.inverse(generate_stations(count, 6.65 * INCH, np.radians(30)))
    of_camera = isotropic_covariance(NOISE.camera_rotation, NOISE.camera_translation)
    return B, np.tile(of_camera, (count, 1, 1))


def general_layout(rng, count):
    """Axes in all directions, distances of 0.3 to 0.6 m, camera noise along its own axes."""
    turns = rotations.exp(0.5 * rng.normal(size=(count, 3)))
    away = np.column_stack([0.05 * rng.normal(size=(count, 2)), rng.uniform(0.3, 0.6, count)])
    return se3.from_parts(turns, away), np.tile(DEEP**2, (count, 1, 1))


def perfect(rng, layout, count):
    B, of_camera = layout(rng, count)
    X = se3.from_parts(rotations.exp(rng.uniform(0, np.pi) * unit(rng)), 9.5 * INCH * unit(rng))
    Z = se3.from_parts(rotations.exp(rng.normal(size=3)), 0.6 * unit(rng))
    return Z @ se3.inverse(B) @ se3.inverse(X), B, X, Z, of_camera


def noisy(rng, A, B, of_camera, trials):
    of_robot = isotropic_covariance(NOISE.robot_rotation, NOISE.robot_translation)
    root = np.linalg.cholesky(of_camera)
    shape = (trials, len(A), 6)
    robot = se3.perturb(A, np.sqrt(np.diag(of_robot)) * rng.normal(size=shape))
    return robot, se3.perturb(B, np.einsum("nij,tnj->tni", root, rng.normal(size=shape)))


def bound(A, B, X, Z, of_camera):
    """Root of the Cramer-Rao bound of rotation and translation."""
    joint = np.zeros((len(A), 12, 12))
    joint[:, :6, :6] = isotropic_covariance(NOISE.robot_rotation, NOISE.robot_translation)
    joint[:, 6:, 6:] = of_camera
    problem = Problem(A, B, star.star_pairs(len(A)), joint)
    influence = solvers.load("maximum-likelihood").influence(problem, Solution(X, Z))
    variance = np.diag(solution_covariance(influence, joint)[:6, :6])
    return np.sqrt([variance[3:].sum(), variance[:3].sum()])


def rms(found, X):
    d = se3.difference(found, X)
    return np.sqrt([np.mean(np.sum(part**2, axis=1)) for part in (d[:, 3:], d[:, :3])])


def by_opencv(name, A, B):
    """gripper_T_camera by one of OpenCV's methods, or None where it fails."""
    R, t = (lambda T: T[:, :3, :3]), (lambda T: T[:, :3, 3])
    try:
        if name in HAND_EYE:
            method = getattr(cv2, f"CALIB_HAND_EYE_{name}")
            answer = cv2.calibrateHandEye(R(A), t(A), R(B), t(B), method=method)
            return se3.from_parts(answer[0], np.ravel(answer[1]))
        method = getattr(cv2, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}")
        base = se3.inverse(A)
        answer = cv2.calibrateRobotWorldHandEye(R(B), t(B), R(base), t(base), method=method)
        return se3.inverse(se3.from_parts(answer[2], np.ravel(answer[3])))
    except cv2.error:
        return None


def show(name, ratios, note=""):
    cells = "".join(f"{rotation:9.2f}{translation:8.2f}" for rotation, translation in ratios)
    print(f"  {name:22}{cells}  {note}", flush=True)


def accuracy(trials, seed):
    counts = (3, 7, 12)
    for layout in (paper_layout, general_layout):
        print(f"\nRMS over the Cramer-Rao bound, {trials} trials: {layout.__doc__.splitlines()[0]}")
        print("  closed forms: here with the pairs of the star, OpenCV's with all pairs")
        print(f"  {'':22}" + "".join(f"{f'N = {count}':>17}" for count in counts))
        print(f"  {'':22}" + f"{'rot':>9}{'trans':>8}" * len(counts))
        cases = []
        for count in counts:
            rng = np.random.default_rng([seed, count])
            A, B, X, Z, of_camera = perfect(rng, layout, count)
            cases.append(
                (*noisy(rng, A, B, of_camera, trials), of_camera, X, bound(A, B, X, Z, of_camera))
            )
        for method in sorted(solvers.names(), key=lambda name: name != solvers.DEFAULT):
            show(method, [ours(method, case) for case in cases])
        for name in (*HAND_EYE, *ROBOT_WORLD) if HAS_OPENCV else ():
            show(f"OpenCV {name}", *theirs(name, cases))


def ours(method, case):
    A, B, of_camera, X, best = case
    found = solve_batch(A, B, method=method, noise=NOISE, camera_covariance=of_camera)
    return rms(found.mount_T_camera, X) / best


def theirs(name, cases):
    ratios, failed = [], []
    for A, B, _, X, best in cases:
        found = [by_opencv(name, a, b) for a, b in zip(A, B, strict=True)]
        good = [each for each in found if each is not None and np.all(np.isfinite(each))]
        failed.append(len(found) - len(good))
        ratios.append(rms(np.array(good), X) / best if good else (np.nan, np.nan))
    note = f"no answer in {', '.join(map(str, failed))} trials" if any(failed) else ""
    return ratios, note


def seconds(call):
    start = time.process_time()
    call()
    return time.process_time() - start


def measure(count, name):
    """Print seconds of one solution and the process's largest memory in MB, as JSON."""
    rng = np.random.default_rng(count)
    A, B, *_, of_camera = perfect(rng, general_layout, count)
    A, B = (poses[0] for poses in noisy(rng, A, B, of_camera, 1))
    if name.startswith("OpenCV"):
        cv2.setNumThreads(1)
        method = name.split()[1]
        taken = seconds(lambda: by_opencv(method, A, B))
    else:
        solve_poses(A[:10], B[:10], method=name)  # whatever is loaded on first use
        taken = min(
            seconds(lambda: solve_poses(A, B, method=name, camera_covariance=of_camera))
            for _ in range(3)
        )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps([taken, peak]))


def scaling(largest):
    counts = [count for count in (10, 100, 1000, 8000) if count <= largest]
    print("\nSeconds of one solution with its predicted error (OpenCV: without), and peak memory")
    heads = "".join(f"{f'N = {count}':>11}" for count in counts)
    print(f"  {'':22}{heads}{'8000/1000':>11}{'MB':>6}")
    names = ["maximum-likelihood", "tsai-lenz", "park-martin", "shah"]
    for name in names + ([f"OpenCV {each}" for each in HAND_EYE] if HAS_OPENCV else []):
        taken, peak = [], np.nan
        for count in counts:
            growth = (count / counts[len(taken) - 1]) ** 2 if taken else 0.0
            if name.startswith("OpenCV") and growth * max(taken, default=0.0) > SLOWEST:
                break
            command = [sys.executable, __file__, "--measure", str(count), name]
            done = subprocess.run(
                command, capture_output=True, text=True, check=True, env=ONE_THREAD
            )
            each, peak = json.loads(done.stdout)
            taken.append(each)
        cells = "".join(f"{each:11.4f}" for each in taken) + f"{'-':>11}" * (
            len(counts) - len(taken)
        )
        growth = f"{taken[3] / taken[2]:11.1f}" if len(taken) == 4 else f"{'-':>11}"
        print(f"  {name:22}{cells}{growth}{peak:6.0f}", flush=True)


def processor_time(command, environment):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def process(runs):
    """Compare whole processes, with compiled modules as an installation has them."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stations.yaml"
        rng = np.random.default_rng(10)
        A, B, *_, of_camera = perfect(rng, general_layout, 10)
        A, B = (poses[0] for poses in noisy(rng, A, B, of_camera, 1))
        rows = [Station(f"{i:02d}", A[i], camera_T_target=UncertainPose(B[i])) for i in range(10)]
        write(Stations(Setup.EYE_IN_HAND, tuple(rows)), str(path))
        handeye = [sys.executable, "-m", "handeye_cli"]
        commands = {
            "import numpy": [sys.executable, "-c", "import numpy"],
            "handeye solve, 10 poses": [*handeye, "solve", str(path)],
            "handeye --help": [*handeye, "--help"],
            "handeye solve --help": [*handeye, "solve", "--help"],
        }
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": folder}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        taken = {name: [] for name in commands}
        for run in range(runs + 1):
            for name, command in commands.items():
                each = processor_time(command, environment)
                if run:  # the first one compiles
                    taken[name].append(each)
    print(f"\nSeconds of whole processes, median of {runs} alternating runs")
    unit_time = statistics.median(taken["import numpy"])
    for name, each in taken.items():
        middle = statistics.median(each)
        print(f"  {name:24}{middle:8.3f} {middle / unit_time:6.2f} x numpy")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=["accuracy", "time", "process", "all"], default="all")
    parser.add_argument("--trials", type=int, default=1000, help="of each layout")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--largest", type=int, default=8000, help="number of stations")
    parser.add_argument("--runs", type=int, default=21, help="of each process")
    parser.add_argument("--measure", nargs=2, metavar=("N", "METHOD"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        measure(int(options.measure[0]), options.measure[1])
        return
    if not HAS_OPENCV:
        print(f"OpenCV {cv2.__version__} has no hand-eye calibration: its rows are left out")
    if options.part in {"accuracy", "all"}:
        accuracy(options.trials, options.seed)
    if options.part in {"time", "all"}:
        scaling(options.largest)
    if options.part in {"process", "all"}:
        process(options.runs)


if __name__ == "__main__":
    main()
