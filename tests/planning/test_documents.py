"""Plans with all that goes past the circle, as documents and as reports."""

import io
from dataclasses import replace

import pytest
import yaml

from handeye_cli import documents
from handeye_cli.errors import InputError
from handeye_cli.plan import plan
from handeye_cli.records.planning import CircleError, Gain, MovedStation, PlanBasis
from handeye_cli.render.console import make_console
from handeye_cli.render.report import show


def full():
    return replace(
        plan(3),
        basis=PlanBasis("paper", "pixels", "lever", 0.2413),
        circle=CircleError(1.7e-3, 3.1e-4, False),
        moved=(MovedStation("02", ("view", "box"), 0.31, 0.0125),),
        gains=(Gain("00", 8.1e-4, 1.9e-4, 6.6e-4, 1.5e-4),),
        order=("00", "02", "01"),
    )


@pytest.mark.parametrize("ending", ["yaml", "json"])
def test_the_document_gives_the_record_back(tmp_path, ending):
    path = str(tmp_path / f"plan.{ending}")
    documents.write(full(), path)
    read = documents.read(path)
    for field in ("basis", "circle", "moved", "gains", "order", "predicted_error", "noise"):
        assert getattr(read, field) == getattr(full(), field)


def test_the_keys_say_their_units():
    data = yaml.safe_load(documents.dump(full(), "yaml"))
    assert data["basis"] == {"robot": "paper", "camera": "pixels", "mount": "lever",
                             "lever_mm": 241.3}  # fmt: skip
    assert data["circle"] == {"rotation_mrad": 1.7, "translation_mm": 0.31, "allowed": False}
    assert data["moved"] == [
        {"name": "02", "limits": ["view", "box"], "rotation_mrad": 310.0, "translation_mm": 12.5}
    ]
    assert data["gains"] == [
        {"name": "00", "rotation_before_mrad": 0.81, "translation_before_mm": 0.19,
         "rotation_mrad": 0.66, "translation_mm": 0.15}
    ]  # fmt: skip


def test_an_order_that_leaves_a_station_out(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(documents.dump(replace(full(), order=("00", "01")), "yaml"))
    with pytest.raises(InputError, match="each of the stations 00, 01, 02 once, found 00, 01"):
        documents.read(str(path))


def test_the_report_tells_all_of_it():
    stream = io.StringIO()
    show(full(), make_console(stream))
    text = stream.getvalue()
    for words in (
        "Shortest way\n  00 02 01",
        "02       17.76  12.5  view, box",
        "00       0.810 -> 0.660  0.190 -> 0.150",
        "the paper's circle, which breaks limits: 1.700 mrad, 0.310 mm",
        "noise: robot the paper's, camera from the pixels",
        "camera 241.3 mm from the gripper, averaged over directions",
    ):
        assert words in text
