#!/bin/sh
# From a plan to a checked answer without a robot: stations are planned, a recording of them is
# rendered, solved and verified, and the answer is compared with the truth. It ends with an error
# where a step fails, or where the answer is far from what it says of itself.
#
#   plan_to_check.sh FOLDER [SEED]
set -eu

folder=${1:?expected the folder to work in}
seed=${2:-7}
target=disc-grid:6x6:5mm:4mm
mkdir -p "$folder"
cd "$folder"

# 1. Where the camera is to go: nine stations to calibrate on, nine in between to verify on.
handeye plan --stations 9 --verification 9 --distance 90mm --tilt 30deg --target "$target" -o plan.yaml

# 2. What it sees from there, and what a noisy robot tells; the truth goes into a file of its own.
handeye simulate recording --plan plan.yaml --target "$target" --seed "$seed" -o made --truth truth.yaml

# 3. Points in the pictures, poses of the target, and the answer with the error to be expected of it.
handeye extract made/recording.yaml -o features.yaml
handeye extrinsics features.yaml -o stations.yaml
handeye solve stations.yaml -o calibration.yaml

# 4. Answers from 5, 7 and 9 stations on as many others; exit code 6 where they miss what is asked for,
#    or are not what was predicted.
handeye verify stations.yaml --stations 5,7,9 --strict \
    --max-rotation-mrad 1 --max-translation-mm 0.3 -o verification.yaml

# 5. What only a simulation can tell: how far the answer is from the truth.
python - <<'END'
import sys

import numpy as np

import handeye_cli

answer, truth = handeye_cli.read("calibration.yaml"), handeye_cli.read("truth.yaml")
apart = np.linalg.solve(truth.mount_T_camera, answer.mount_T_camera.matrix)
off_mm = 1e3 * np.linalg.norm(apart[:3, 3])
off_mrad = 1e3 * np.linalg.norm(apart[:3, :3] - np.eye(3)) / np.sqrt(2.0)  # of a small angle
most_mrad = 1e3 * answer.predicted_error.rotation_95
most_mm = 1e3 * answer.predicted_error.translation_95
print(f"from the truth: {off_mrad:.3f} mrad, {off_mm:.3f} mm")
print(f"95 % are within {most_mrad:.3f} mrad, {most_mm:.3f} mm")
if off_mrad > 2.0 * most_mrad or off_mm > 2.0 * most_mm:
    sys.exit("the answer is farther from the truth than chance allows")
END
