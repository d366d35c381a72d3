"""Jobs in processes: what dies is named, what is left early ends."""

import os
import time

import pytest
from engines.labours import by_word, environment, sleep_on

from handeye_cli.engines import WorkerDiedError, engine_of


def ends(words, workers, work=by_word):
    found = sorted(engine_of("processes", workers).run(work, words), key=lambda each: each.index)
    assert [each.index for each in found] == list(range(len(words)))
    return found


def test_each_job_ends_once_and_a_fault_is_its_own():
    found = ends(["a", "raise", "b", "c", "raise"], 2)
    assert [each.result for each in found] == ["aa", None, "bb", "cc", None]
    assert [type(each.fault) for each in found] == [
        type(None), KeyError, type(None), type(None), KeyError,
    ]  # fmt: skip


@pytest.mark.parametrize("workers", [1, 2])
def test_a_process_that_dies_takes_no_other_job_along(workers):
    found = ends(["a", "b", "die", "c", "d", "die", "e"], workers)
    assert [each.result for each in found] == ["aa", "bb", None, "cc", "dd", None, "ee"]
    assert all(isinstance(found[index].fault, WorkerDiedError) for index in (2, 5))
    assert "memory" in str(found[2].fault)


def test_libraries_are_told_to_keep_to_one_thread(monkeypatch):
    names = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"]
    for name in names:
        monkeypatch.setenv(name, "2")
    before = {name: os.environ.get(name) for name in names}
    assert [each.result for each in ends(names, 1, environment)] == ["1"] * 3
    assert {name: os.environ.get(name) for name in names} == before


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_leaving_early_ends_what_runs(tmp_path):
    begun = tmp_path / "begun"
    running = engine_of("processes", 1).run(sleep_on, [str(begun)])
    with pytest.MonkeyPatch.context() as patch:
        # the wait for the first job is where a Ctrl-C reaches the engine
        patch.setattr("handeye_cli.engines.processes.wait", lambda *_, **__: interrupted(begun))
        with pytest.raises(KeyboardInterrupt):
            next(running)
    assert not alive(int(begun.read_text()))


def interrupted(begun):
    patience = time.monotonic() + 20
    while not (begun.exists() and begun.read_text()) and time.monotonic() < patience:
        time.sleep(0.02)
    raise KeyboardInterrupt


def test_no_jobs_need_no_processes():
    assert ends([], 1) == []
