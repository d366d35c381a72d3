"""Odd words, names and texts: one clear sentence, the right exit code, and nothing written."""

import json

import pytest
from cli.scene import stations_document

TEXT = json.dumps(stations_document(4))
LONG = "x" * 5000
SMALL = ["simulate", "recording", "--stations", "3", "--width", "64", "--height", "48",
         "--focal-px", "60"]  # fmt: skip
PLAN = ["plan", "--stations", "5"]
COMPARED = ["verify", "good.json", "--calibration"]


@pytest.fixture
def refused(handeye, tmp_path, monkeypatch):
    """Run a line that must be refused, in a folder that it must leave as it is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.json").write_text(TEXT, encoding="utf-8")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")

    def run(words, code, message, stdin=b""):
        before = sorted(tmp_path.rglob("*"))
        done = handeye(*words, stdin=stdin)
        assert (done.code, done.out) == (code, ""), done.err
        assert done.err.startswith("error: ")
        assert done.err.count("error: ") == 1
        assert message in done.err
        assert sorted(tmp_path.rglob("*")) == before

    return run


VALUES = {
    "no input": (["solve", ""], "expected a value for INPUT, found an empty text"),
    "no input of several": (["batch", "good.json", ""], "value for RECORDING, found an empty text"),
    "no folder": (["batch", "good.json", "--out-dir", ""], "value for --out-dir, found an empty"),
    "no output": (["solve", "good.json", "-o", ""], "value for --output, found an empty text"),
    "no fault": ([*SMALL, "--fault", "", "-o", "new"], "value for --fault, found an empty text"),
    "infinite limit": (["verify", "good.json", "--max-rotation-mrad", "inf"], "found inf"),
    "no number": (["verify", "good.json", "--max-translation-mm", "nan"], "nan"),
    "huge level": ([*PLAN, "--camera-rotation-mrad", "1e300"], "at most 1e+12, found 1e+300"),
    "far away": ([*PLAN, "--distance", "1e18m"], "at most 100 m, found '1e18m'"),
    "far camera": ([*SMALL, "--distance", "1e9m", "-o", "new"], "at most 100 m, found '1e9m'"),
    "long pause": ([*SMALL, "--pause", "1e9s", "-o", "new.mcap"], "found 15000000"),
    "long lag": ([*SMALL, "--fault", "time-offset:1e9s", "-o", "new.mcap"], "found '1e9s'"),
    "two setups": (["solve", "good.json", "--setup", "eye-in-hand", "--setup=eye-to-hand"],
                   "expected --setup once, found it with 'eye-in-hand' and with 'eye-to-hand'"),
    "two outputs": (["solve", "good.json", "-o", "a.yaml", "--output", "b.yaml"],
                    "expected --output once, found it with 'a.yaml' and with 'b.yaml'"),
    "stdin for two": (["verify", "-", "--calibration", "-"],
                      "standard input once, found it as INPUT and as --calibration"),
    "names and stdin": (["batch", "@-", "--calibration", "-"], "as RECORDING and as --calibration"),
    "stream as folder": (["batch", "good.json", "--out-dir", "-"], "expected a folder, found '-'"),
    "stream as recording": ([*SMALL, "-o", "-"], "found '-', which stands for a stream"),
    "stream as table": ([*PLAN, "--csv", "-"], "the name of a file, found '-'"),
    "folder as output": (["solve", "good.json", "-o", "new/"], "file, found that of a folder"),
    "folder that is there": (["solve", "good.json", "-o", "folder"], "a file, found a folder"),
    "table in a table's place": (
        ["batch", "good.json", "--out-dir", "folder", "-o", "folder/good.yaml"],
        "expected -o to be a file of its own, found folder/good.yaml"),
}  # fmt: skip
"""Words that are wrong usage, and what is said."""


@pytest.mark.parametrize("row", VALUES)
def test_values_that_no_flag_can_have(refused, row):
    words, message = VALUES[row]
    refused(words, 2, message)


def test_a_flag_may_be_repeated_if_it_says_the_same(handeye, tmp_path):
    path = tmp_path / "good.json"
    path.write_text(TEXT, encoding="utf-8")
    flags = ["--setup", "eye-in-hand", "--setup=eye-in-hand", "-q", "-q"]
    assert handeye("solve", path, *flags).code == 0


NAMES = {
    "long": (["import", LONG], "expected a readable file or folder: File name too long"),
    "long images": (["import", "poses.csv", "--images", LONG], "File name too long"),
    "loop": (["solve", "loop"], "loop: expected a readable file: Too many levels"),
    "loop beside": (["solve", "good.json", "--mcap", "loop"], "loop: cannot be written"),
    "loop to read": (["solve", "loop", "--mcap", "new.mcap"], "loop: expected a readable file"),
    "another kind": ([*COMPARED, "good.json"], "hint: handeye solve makes one"),
    "no plan": ([*SMALL[:2], "--plan", "good.json", "-o", "new"], "hint: handeye plan makes one"),
}
"""Words that name what cannot be read or written, and what is said."""


@pytest.mark.parametrize("row", NAMES)
def test_names_of_nothing_that_could_be_used(refused, tmp_path, row):
    (tmp_path / "poses.csv").write_text("name,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n")
    words, message = NAMES[row]
    more = ["--setup", "eye-in-hand"] if words[0] == "import" else []
    refused([*words, *more], 3, message)


TEXTS = {
    "UTF-16 cut off": (TEXT.encode("utf-16")[:-1], "expected UTF-16 text, as its first bytes say"),
    "UTF-16 without its mark": (TEXT.encode("utf-16-le"), "line 1: not valid YAML or JSON: con"),
    "UTF-32": (TEXT.encode("utf-32"), "not allowed, found a zero byte"),
    "tab": (b"stations:\n\t- name: a\n", "hint: it is a tab: indent with spaces"),
    "comment of C": (b"// of today\n" + TEXT.encode(), "YAML nor JSON has comments with //"),
    "two documents": (b"a: 1\n---\nb: 2\n", "line 2, column 1: expected one document"),
    "not a number": (TEXT.replace("[", "[NaN, ", 2).encode(), "stations[0]"),
}  # fmt: skip
"""Bytes that are no document, and what is said."""


@pytest.mark.parametrize("row", TEXTS)
def test_texts_that_are_no_documents(refused, row):
    content, message = TEXTS[row]
    refused(["solve", "-"], 3, message, stdin=content)


READABLE = {
    "CRLF": TEXT.replace(", ", ",\r\n").encode(),
    "UTF-8 with its mark": TEXT.encode("utf-8-sig"),
    "UTF-16": TEXT.encode("utf-16"),
    "end": b"%YAML 1.2\n---\n" + TEXT.encode() + b"\n...\n",
}


@pytest.mark.parametrize("row", READABLE)
def test_texts_that_are_unusual(handeye, row):
    assert handeye("inspect", "-", "-q", stdin=READABLE[row]).code == 0


@pytest.mark.parametrize(
    "name", ["a b.json", "ü'ñ.json", "#.json", "a\nb.json", "$x.json", "[1].json", "\udcff.json"]
)
def test_names_of_files_are_of_no_importance(handeye, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(TEXT, encoding="utf-8")
    done = handeye("solve", name, "-q", "-o", f"out-{name}")
    assert (done.code, done.out) == (0, ""), done.err
    assert (tmp_path / f"out-{name}").exists()


def test_a_document_has_the_same_bytes_in_any_locale(shell, tmp_path):
    path = tmp_path / "über.json"
    path.write_text(TEXT, encoding="utf-8")
    line = f"handeye solve -q '{path}'"
    plain, ascii_only = shell(line), shell(f"PYTHONUTF8=0 PYTHONIOENCODING=ascii {line}")
    assert (plain.code, plain.err) == (0, "")
    assert "über.json" in plain.out
    assert ascii_only == plain


def test_a_calibration_out_of_a_pipe_is_read_once(shell, tmp_path):
    path = tmp_path / "good.json"
    path.write_text(TEXT, encoding="utf-8")
    line = f"handeye plan --stations 4 -q --calibration <(handeye solve -q '{path}')"
    done = shell(line)
    assert (done.code, done.err) == (0, "")
    assert "base_T_gripper" in done.out
