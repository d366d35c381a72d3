"""One command and a pipe of several: the same digits, in processes of their own."""

import json

import pytest
import yaml
from line.recordings import SAMPLE, TARGETS

RECORDING = SAMPLE / "recording.yaml"


def without_provenance(text):
    document = yaml.load(text, yaml.CSafeLoader) if text.startswith("schema") else json.loads(text)
    assert document.pop("provenance")
    return document


def output(shell, line):
    done = shell(line)
    assert done.code == 0, done.err
    return done.out


@pytest.mark.parametrize("recording", TARGETS)
def test_a_pipe_gives_what_one_command_gives(shell, recording):
    at_once = output(shell, f"handeye solve '{recording}'")
    piped = output(shell, f"handeye extract '{recording}' | handeye extrinsics - | handeye solve -")
    assert without_provenance(piped) == without_provenance(at_once)


def test_json_in_the_middle_changes_no_digit(shell):
    at_once = output(shell, f"handeye solve '{RECORDING}'")
    piped = output(
        shell,
        f"cd '{SAMPLE}' && cat recording.yaml | handeye extract - --json"
        " | handeye extrinsics - --json | handeye solve - --json",
    )
    assert piped.startswith("{")
    assert without_provenance(piped) == without_provenance(at_once)


def test_a_second_run_and_any_number_of_workers_give_the_same_bytes(shell):
    runs = [output(shell, f"handeye solve '{RECORDING}' --workers {n}") for n in (1, 4, 4)]
    assert runs[0] == runs[1] == runs[2]


def test_verification_in_steps_and_at_once(handeye, tmp_path):
    features, stations = tmp_path / "features.yaml", tmp_path / "stations.json"
    assert handeye("extract", RECORDING, "-o", features).code == 0
    assert handeye("extrinsics", features, "-o", stations).code == 0
    results = [
        without_provenance(handeye("verify", source, "--stations", "4,6", "--json").out)
        for source in (RECORDING, features, stations)
    ]
    assert results[0] == results[1] == results[2]
