#!/bin/sh
# Makes the sample recordings beside this script from plan.yaml and camera.yaml: the paper's plate as
# a folder with its truth, and the run of a robot through the same stations as an MCAP file.
set -eu
cd "$(dirname "$0")"

made_of="--plan plan.yaml --camera camera.yaml --target disc-grid:6x6:5mm:4mm --gradient 0.12,-0.08 --seed 1989"

# shellcheck disable=SC2086 # a list of words
handeye simulate recording $made_of -o paper-plate --truth paper-plate/truth.yaml --force

# Few and less noisy pictures keep this file small: one in each pause, one on most of the ways between.
# shellcheck disable=SC2086
handeye simulate recording $made_of --image-noise 1 --rate 0.5 --pause 2.1s --tf-rate 50 \
    -o paper-plate.mcap --force
