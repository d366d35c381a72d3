"""A file that is written bit by bit is there wholly or not at all."""

import pytest

from handeye_cli.documents import streamed_file
from handeye_cli.errors import InputError, UsageError


def write_and(then, path, **options):
    """Write half of a file, and do something while it is open."""
    with streamed_file(str(path), **options) as file:
        file.write(b"half")
        then()


def fail(error):
    raise error


def test_it_gets_its_name_when_all_is_written(tmp_path):
    path = tmp_path / "out.bin"
    with streamed_file(str(path)) as file:
        file.write(b"first, ")
        assert not path.exists()
        file.write(b"second")
    assert path.read_bytes() == b"first, second"
    assert [each.name for each in tmp_path.iterdir()] == ["out.bin"]


def test_nothing_is_left_when_the_writing_fails(tmp_path):
    path = tmp_path / "out.bin"
    path.write_bytes(b"before")
    with pytest.raises(ZeroDivisionError):
        write_and(lambda: fail(ZeroDivisionError()), path, force=True)
    assert path.read_bytes() == b"before"
    assert [each.name for each in tmp_path.iterdir()] == ["out.bin"]


def test_a_full_disk_is_an_input_error_that_names_the_file(tmp_path):
    path = tmp_path / "out.bin"
    with pytest.raises(InputError, match=r"out\.bin: cannot be written: No space left"):
        write_and(lambda: fail(OSError(28, "No space left on device")), path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_or_appears_meanwhile_stays(tmp_path):
    path = tmp_path / "out.bin"
    with pytest.raises(UsageError, match="exists already"):
        write_and(lambda: path.write_bytes(b"another's"), path)
    assert path.read_bytes() == b"another's"
    with pytest.raises(UsageError, match="exists already"):
        write_and(lambda: pytest.fail("it was opened"), path)
    write_and(lambda: None, path, force=True)
    assert path.read_bytes() == b"half"
    assert [each.name for each in tmp_path.iterdir()] == ["out.bin"]
