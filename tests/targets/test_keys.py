import pytest

from handeye_cli import targets
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import TargetSpec

DISCS = {"rows": 6, "columns": 6, "spacing_mm": 5, "diameter_mm": 4}
CHARUCO = {
    "columns": 5, "rows": 7, "square_mm": 30.0, "marker_mm": 20.0, "dictionary": "DICT_6X6_250",
}  # fmt: skip
TAG = {"family": "36h11", "size_mm": 48}

FAULTS = {
    "unknown type": ("disk-grid", DISCS, ["'disk-grid'", "did you mean 'disc-grid'"]),
    "unknown key": ("disc-grid", DISCS | {"spacing": 5}, ["'spacing'", "mean 'spacing_mm'"]),
    "far key": ("disc-grid", DISCS | {"colour": "red"}, ["'colour'"]),
    "missing key": ("disc-grid", {"rows": 6, "columns": 6}, ["spacing_mm, diameter_mm"]),
    "word for a number": ("disc-grid", DISCS | {"rows": "six"}, ["rows", "'six'"]),
    "fraction": ("disc-grid", DISCS | {"rows": 6.5}, ["whole number", "rows", "6.5"]),
    "truth for a number": ("disc-grid", DISCS | {"rows": True}, ["rows", "True"]),
    "truth for a length": ("disc-grid", DISCS | {"spacing_mm": True}, ["spacing_mm", "True"]),
    "too few": ("disc-grid", DISCS | {"columns": 1}, ["from 2", "columns", "found 1"]),
    "too many": ("disc-grid", DISCS | {"rows": 10**9}, ["to 1000", "rows", "found 1000000000"]),
    "negative": ("disc-grid", DISCS | {"spacing_mm": -5}, ["above 0", "spacing_mm", "-5"]),
    "zero": ("disc-grid", DISCS | {"diameter_mm": 0}, ["above 0", "diameter_mm", "found 0"]),
    "not finite": ("disc-grid", DISCS | {"spacing_mm": float("nan")}, ["spacing_mm", "nan"]),
    "longer than a float": ("disc-grid", DISCS | {"spacing_mm": 10**400}, ["1e+06 mm", "found 10"]),
    "as good as nothing": (
        "chessboard", {"columns": 9, "rows": 6, "square_mm": 1e-320}, ["from 1e-06", "1e-320"],
    ),
    "too many discs": (
        "disc-grid", DISCS | {"rows": 72, "columns": 70}, ["at most 5000 discs", "70 x 72 = 5040"],
    ),
    "too many circles": (
        "asymmetric-circles", DISCS | {"rows": 1000, "columns": 1000}, ["1000 x 1000 = 1000000"],
    ),
    "too many corners": (
        "chessboard", {"columns": 6, "rows": 1000, "square_mm": 9},
        ["at most 5000 corners", "6 x 1000 = 6000"],
    ),
    "discs touch": (
        "disc-grid", DISCS | {"diameter_mm": 5}, ["below", "spacing_mm of 5", "found 5"],
    ),
    "small corner": (
        "disc-grid", DISCS | {"corner_diameter_mm": 4}, ["corner_diameter_mm", "found 4"],
    ),
    "corner touches": (
        "disc-grid", DISCS | {"corner_diameter_mm": 6.5}, ["the 6 that leave room", "found 6.5"],
    ),
    "circles touch": (
        "asymmetric-circles", DISCS | {"diameter_mm": 7.1}, ["7.07107", "found 7.1"],
    ),
    "marker too large": ("charuco", CHARUCO | {"marker_mm": 30}, ["square_mm of 30", "found 30"]),
    "dictionary": (
        "charuco", CHARUCO | {"dictionary": "DICT_6X6_25"}, ["'DICT_6X6_25'", "'DICT_6X6_250'"],
    ),
    "dictionary too small": (
        "charuco", CHARUCO | {"dictionary": "DICT_4X4_50", "rows": 21},
        ["at least 52", "DICT_4X4_50 of 50"],
    ),
    "legacy": ("charuco", CHARUCO | {"legacy": "yes"}, ["true or false", "'yes'"]),
    "family": ("apriltag", TAG | {"family": "36h12"}, ["'36h12'", "did you mean '36h11'"]),
    "family as number": ("apriltag", TAG | {"family": 36}, ["a name", "family", "36"]),
    "negative id": ("apriltag", TAG | {"id": -1}, ["id", "found -1"]),
    "id not in the dictionary": ("apriltag", TAG | {"id": 587}, ["at least 588", "of 587"]),
    "grid larger than the dictionary": (
        "aruco-grid",
        {"dictionary": "DICT_4X4_50", "columns": 8, "rows": 7, "size_mm": 9, "gap_mm": 1},
        ["at least 56", "DICT_4X4_50 of 50"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_wrong_target_is_refused_with_the_value(name):
    kind, parameters, words = FAULTS[name]
    with pytest.raises(InputError) as caught:
        targets.build(TargetSpec(kind, parameters))
    assert caught.value.where == "target"
    for word in words:
        assert word in str(caught.value)


def test_an_optional_key_may_be_left_out_and_whole_numbers_are_lengths():
    board = targets.build(TargetSpec("disc-grid", DISCS))
    assert board.spec == TargetSpec("disc-grid", DISCS)
    assert board.points()[-1].tolist() == pytest.approx([0.025, 0.025, 0.0])


@pytest.mark.parametrize("name", ["36h11", "tag36h11", "Tag36H11", "DICT_APRILTAG_36h11"])
def test_a_family_has_several_names(name):
    targets.build(TargetSpec("apriltag", TAG | {"family": name}))


SHORTHANDS = {
    "disc-grid:6x6:5mm:4mm": DISCS,
    "disc-grid:10x8:25.4mm:12.7mm:25.4mm": {
        "columns": 10, "rows": 8, "spacing_mm": 25.4, "diameter_mm": 12.7,
        "corner_diameter_mm": 25.4,
    },
    "asymmetric-circles:4x11:20mm:10mm": {
        "columns": 4, "rows": 11, "spacing_mm": 20, "diameter_mm": 10,
    },
    "chessboard:9x6:23.6mm": {"columns": 9, "rows": 6, "square_mm": 23.6},
    "charuco:5x7:36.195mm:18.256mm:DICT_6X6_250:legacy": {
        "columns": 5, "rows": 7, "square_mm": 36.195, "marker_mm": 18.256,
        "dictionary": "DICT_6X6_250", "legacy": True,
    },
    "charuco:5x7:36.195mm:18.256mm:DICT_6X6_250:legacy=false": {
        "columns": 5, "rows": 7, "square_mm": 36.195, "marker_mm": 18.256,
        "dictionary": "DICT_6X6_250", "legacy": False,
    },
    "apriltag:36h11:48mm": {"family": "36h11", "size_mm": 48},
    "apriltag:36h11:48mm:id=0": {"family": "36h11", "size_mm": 48, "id": 0},
    "aruco:DICT_5X5_100:40mm:id=7": {"dictionary": "DICT_5X5_100", "size_mm": 40, "id": 7},
    "apriltag-grid:36h11:6x5:55mm:16.5mm": {
        "family": "36h11", "columns": 6, "rows": 5, "size_mm": 55, "gap_mm": 16.5,
    },
    "aruco-grid:DICT_5X5_100:5x7:40mm:8mm": {
        "dictionary": "DICT_5X5_100", "columns": 5, "rows": 7, "size_mm": 40, "gap_mm": 8,
    },
}  # fmt: skip


@pytest.mark.parametrize("text", SHORTHANDS)
def test_a_shorthand_is_read_and_written(text):
    spec = targets.parse(text)
    assert spec == TargetSpec(text.split(":")[0], SHORTHANDS[text])
    assert targets.shorthand(spec) == text


def test_lengths_of_a_shorthand_may_have_any_unit():
    spec = targets.parse("disc-grid:6x6:1in:1.27cm")
    assert spec.parameters["spacing_mm"] == 25.4
    assert targets.shorthand(spec) == "disc-grid:6x6:25.4mm:12.7mm"


WRONG = {
    "disk-grid:6x6:5mm:4mm": ["'disk-grid'", "did you mean 'disc-grid'"],
    "": ["found ''", "disc-grid:6x6:5mm:4mm"],
    "disc-grid": ["disc-grid:COLUMNSxROWS:SPACING:DIAMETER[:CORNER_DIAMETER]", "'disc-grid'"],
    "disc-grid:6:5mm:4mm": ["'disc-grid:6:5mm:4mm'", "disc-grid:6x6:5mm:4mm"],
    "disc-grid:6x6:5:4mm": ["found '5'", "disc-grid:6x6:5mm:4mm"],
    "disc-grid:6x6:5mm:4mm:6mm:7mm": ["6mm:7mm", "disc-grid:6x6:5mm:4mm"],
    "disc-grid:6x6:4mm:5mm": ["spacing_mm of 4", "found 5", "disc-grid:6x6:5mm:4mm"],
    "chessboard:0x6:1mm": ["columns", "found 0", "chessboard:9x6:23.6mm"],
    "charuco:5x7:36mm:18mm": ["'charuco:5x7:36mm:18mm'", "DICT_6X6_250"],
    "charuco:5x7:36mm:18mm:DICT_6X6_250:old": ["[:legacy]", ":old'"],
    "apriltag:36h11:48mm:0": ["[:id=ID]", "48mm:0'", "apriltag:36h11:48mm"],
    "apriltag-grid:36h9:6x6:55mm:16.5mm": ["'36h9'"],
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_shorthand_is_refused_with_an_example(text):
    with pytest.raises(UsageError) as caught:
        targets.parse(text)
    assert caught.value.where == "--target"
    for word in WRONG[text]:
        assert word in str(caught.value)
