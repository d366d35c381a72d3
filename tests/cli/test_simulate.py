"""`handeye simulate`: documents, reports, pictures and refusals."""

import json
import sys

import cv2
import pytest
import yaml
from documents.test_round_trip import validator_for_editors
from simulate.paper_setting import PAPER

from handeye_cli.render import figure_plot
from handeye_cli.simulate.figures import simulate_figures

FEW = ["simulate", "--trials", "20"]


def test_the_papers_base_setting_is_the_default(handeye):
    done = handeye("simulate", "--seed", "2")
    assert (done.code, done.err) == (0, "")
    document = yaml.safe_load(done.out)
    validator_for_editors("simulation").validate(document)
    written = (
        "--stations 3 --tilt 30deg --trials 1000 --seed 2 --method tsai-lenz --distance 6.65in"
    )
    noise = "--robot-rotation 1.5mrad --robot-translation 5mil --camera-rotation 1.5mrad"
    same = handeye("simulate", *written.split(), *noise.split())
    assert same.out == done.out
    assert document["rotation_rms_mrad"] == pytest.approx(3.15, abs=0.2)
    assert document["translation_rms_mm"] == pytest.approx(27.1 * 0.0254, abs=0.05)
    assert document["crb"]["rotation_mrad"] < document["rotation_rms_mrad"]
    assert document["predicted"]["rotation_mrad"] == pytest.approx(4.41, abs=0.01)
    assert document["provenance"][0]["options"] == {"seed": 2}


def test_flags_reach_the_simulation(handeye):
    done = handeye(
        *FEW, "--stations", "6", "--distance", "0.4m", "--tilt", "20deg", "--lever", "50mm",
        "--pairs", "all", "--method", "shah", "--robot-rotation", "0.1deg",
        "--robot-translation", "0.2mm", "--camera-rotation", "2mrad",
        "--camera-translation", "40um", "--seed", "9",
    )  # fmt: skip
    document = yaml.safe_load(done.out)
    assert document["setting"] == {
        "stations": 6, "distance_mm": 400.0, "tilt_deg": 20.0, "lever_mm": 50.0, "pairs": "all",
    }  # fmt: skip
    assert document["noise"] == pytest.approx(
        {
            "robot_rotation_mrad": 1.7453292519943295,
            "robot_translation_mm": 0.2,
            "camera_rotation_mrad": 2.0,
            "camera_translation_mm": 0.04,
        }
    )
    assert (document["method"], document["trials"], document["seed"]) == ("shah", 20, 9)


def test_a_figure_is_its_points(handeye):
    document = json.loads(handeye(*FEW, "--figure", "8", "--json").out)
    validator_for_editors("simulation").validate(document)
    assert (document["figure"], document["trials"], document["varied"]) == (8, 20, "tilt")
    expected = simulate_figures([8], PAPER, 20, 0).figures[0]
    found = [(point["abscissa"], point["rms"], point["crb"]) for point in document["points"]]
    for row, point in zip(found, expected.points, strict=True):
        assert row == pytest.approx((point.abscissa, 1e3 * point.rms, 1e3 * point.bound))


def test_all_figures_in_one_document(handeye):
    document = yaml.safe_load(handeye(*FEW, "--figure", "all").out)
    validator_for_editors("simulation").validate(document)
    assert [figure["figure"] for figure in document["figures"]] == [8, 9, 10, 11, 12, 13]
    one = yaml.safe_load(handeye(*FEW, "--figure", "11").out)
    assert document["figures"][3]["points"] == one["points"]


def test_the_same_seed_gives_the_same_bytes(handeye, tmp_path):
    for name in ("a.yaml", "b.yaml"):
        assert handeye(*FEW, "--figure", "12", "-o", tmp_path / name).code == 0
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "b.yaml").read_bytes()
    other = handeye(*FEW, "--figure", "12", "--seed", "1")
    assert other.out.encode() != (tmp_path / "a.yaml").read_bytes()


def test_a_terminal_gets_the_report(handeye):
    done = handeye(*FEW, "--figure", "11", terminal=True)
    assert done.code == 0
    assert "Figure 11: translation error in mm" in done.out
    assert "schema" not in done.out


def test_a_picture_changes_nothing(handeye, tmp_path):
    pytest.importorskip("matplotlib")
    one = handeye(*FEW, "--figure", "10", "--plot", tmp_path / "mine.png")
    assert one.code == 0
    assert one.out == handeye(*FEW, "--figure", "10").out
    assert cv2.imread(str(tmp_path / "mine.png")).shape[1] > 500


def test_each_figure_has_a_picture_of_its_own(handeye, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(figure_plot, "figure_png", lambda figure, _: b"%d" % figure.number)
    done = handeye(*FEW, "--figure", "all", "--plot", tmp_path / "f.png", "-o", tmp_path / "f.yaml")
    assert done.code == 0
    pictures = {path.name: path.read_bytes() for path in tmp_path.glob("*.png")}
    assert pictures == {f"f-{number:02d}.png": b"%d" % number for number in range(8, 14)}


def test_a_picture_that_exists_is_kept(handeye, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "f-09.png"
    path.write_text("mine")
    done = handeye(*FEW, "--figure", "all", "--plot", tmp_path / "f.png")
    assert (done.code, done.out) == (2, "")
    assert "f-09.png: the file exists already" in done.err
    assert [path.read_text(), *tmp_path.iterdir()] == ["mine", path]
    assert handeye(*FEW, "--figure", "9", "--plot", path, "--force").code == 0
    assert path.read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_nothing_is_simulated(handeye, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = handeye(*FEW, "--figure", "9", "--plot", tmp_path / "f.png")
    assert (done.code, done.out) == (2, "")
    assert 'pip install "handeye-cli[plot]"' in done.err
    assert handeye(*FEW, "--figure", "9").code == 0


REFUSED = {
    "another figure": (["--figure", "7"], "8 to 13 or all, found '7'"),
    "no figure": (["--figure", "eight"], "found 'eight'"),
    "no trials": (["--trials", "0"], "1 to 100000 trials, found 0"),
    "a negative seed": (["--seed", "-1"], "at least 0, found -1"),
    "two stations": (["--stations", "2"], "3 to 1000 stations, found 2"),
    "an unknown method": (["--method", "tsai"], "did you mean tsai-lenz?"),
    "no unit": (["--robot-rotation", "1.5"], "mrad, rad, deg, found '1.5'"),
    "a picture of nothing": (["--plot", "a.png"], "--plot draws a figure"),
    "another format": (["--figure", "8", "--plot", "a.svg"], "ends in .png, found 'a.svg'"),
    "no folder": (["--figure", "8", "--plot", "no/where/a.png"], "an existing folder"),
    "a tilt that is varied": (["--figure", "8", "--tilt", "20deg"], "figure 8 varies it"),
    "a distance that is varied": (["--figure", "11", "--distance", "1m"], "--distance 1m has no"),
    "stations that are varied": (["--figure", "13", "--stations", "5"], "--stations 5 has no"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_wrong_usage(handeye, fault):
    words, message = REFUSED[fault]
    done = handeye("simulate", *words)
    assert done.code == (3 if fault == "no folder" else 2)
    assert done.out == ""
    assert message in done.err


def test_what_does_not_settle_has_its_own_exit_code(handeye):
    done = handeye(
        "simulate", "--method", "maximum-likelihood", "--tilt", "0.1deg", "--trials", "200"
    )
    assert (done.code, done.out) == (5, "")
    assert "did not settle in all of 200" in done.err


def test_a_simulation_is_no_input_of_the_line(handeye, tmp_path):
    path = tmp_path / "simulation.yaml"
    assert handeye(*FEW, "-o", path).code == 0
    done = handeye("solve", path)
    assert done.code == 3
    assert "simulation" in done.err
