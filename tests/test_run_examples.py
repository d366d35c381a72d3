"""How near the output of an example has to be to the one that a document shows."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / ".ci" / "run_examples.py"
pytest.importorskip("pty", reason="examples are run in a terminal of Unix")
if not SCRIPT.is_file():
    pytest.skip("the script is part of the checkout only", allow_module_level=True)


@pytest.fixture(scope="module")
def agrees():
    spec = importlib.util.spec_from_file_location("run_examples", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.agrees


SAME = [
    ("rotation 0.092 mrad\n", "rotation  0.094 mrad\n"),
    ("120 of 480 pixels\n", "123 of 480 pixels\n"),
    ("p = 1.00e-09\n", "p = 1.02e-09\n"),
    ("a 1\n...\nz 3\n", "a 1\nb 7\nc 8\nz 3\n"),
    ("a 1\n...\n", "a 1\n"),
    ("...\nz 3\n", "z 4\nb\n\nz 3\n"),
    ("", "anything\n"),
]
OTHER = [
    ("rotation 0.092 mrad\n", "rotation 0.192 mrad\n"),
    ("rotation 0.092 mrad\n", "rotation -0.092 mrad\n"),
    ("rotation 0.092 mrad\n", "translation 0.092 mrad\n"),
    ("9 stations\n", "8 stations\n"),
    ("p = 1e-09\n", "p = 1e-08\n"),
    ("a 1\n...\nz 3\n", "a 1\nb 7\nz 5\n"),
    ("a 1\n", "a 1\nb 2\n"),
    ("a 1\nb 2\n", "a 1\n"),
    ("a 1 2\n", "a 1\n"),
]


@pytest.mark.parametrize(("shown", "real"), SAME)
def test_outputs_that_are_as_good_agree(agrees, shown, real):
    assert agrees(shown, real)


@pytest.mark.parametrize(("shown", "real"), OTHER)
def test_other_words_and_other_numbers_do_not(agrees, shown, real):
    assert not agrees(shown, real)
