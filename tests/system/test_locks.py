"""One process at a time writes results; locks of processes that are gone are taken over."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import nullcontext
from pathlib import Path

import pytest

from porefv.errors import InputError
from porefv.system import locks
from porefv.system.atomic_files import atomic_directory, locked, put_back
from porefv.system.signals import ENDING, Terminated, end, handled

HOLD = """
import sys, time
from porefv.system.atomic_files import locked
with locked(sys.argv[1]):
    print(1, flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the lock of `results`."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, tmp_path / "results"], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"1\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_is_refused_and_told_by_whom(holder, tmp_path):
    said = rf"results is being written by process {holder.pid} on {socket.gethostname()}, since 20.* Wait"
    with pytest.raises(InputError, match=said), locked(tmp_path / "results"):
        pass
    with pytest.raises(InputError, match="being written"), atomic_directory(tmp_path / "results"):
        pass
    with locked(tmp_path / "others"):
        pass


def test_by_another_name_it_is_the_same(holder, tmp_path):
    (tmp_path / "link").symlink_to("results")
    with pytest.raises(InputError, match="being written"), locked(tmp_path / "link"):
        pass


def test_the_lock_of_a_process_that_was_killed_is_taken_over(holder, tmp_path):
    holder.kill()
    holder.wait()
    assert (tmp_path / ".results.porefv-lock").exists()
    with locked(tmp_path / "results"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_threads_exclude_each_other_and_wait_for_nobody(tmp_path):
    refused = []

    def second():
        try:
            with locked(tmp_path / "results"):
                pass
        except InputError as error:
            refused.append(error)

    with locked(tmp_path / "results"):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join()
    assert len(refused) == 1
    second()
    assert len(refused) == 1


# Take the lock ten times, however often it is refused; fail if anybody else has it meanwhile.
TAKE = """
import pathlib, sys, time
from porefv.errors import InputError
from porefv.system.atomic_files import locked
place, taken = pathlib.Path(sys.argv[1]), 0
while taken < 10:
    try:
        with locked(place / "results"):
            (place / "mine").mkdir()
            (place / "mine").rmdir()
            taken += 1
    except InputError:
        time.sleep(0.001)
"""


def test_of_many_processes_one_at_a_time_holds_it(tmp_path):
    processes = [subprocess.Popen([sys.executable, "-c", TAKE, tmp_path]) for _ in range(4)]
    assert [process.wait(timeout=120) for process in processes] == [0] * 4
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="copies of the process by fork")
def test_a_process_made_by_fork_does_not_keep_the_lock(tmp_path):
    reader, writer = os.pipe()
    with locked(tmp_path / "results"):
        process = os.fork()
        if process == 0:
            os.close(writer)
            os.read(reader, 1)  # until the test is over
            os._exit(0)
    with locked(tmp_path / "results"):
        pass
    os.close(writer)
    os.waitpid(process, 0)


# ---- where the system's locks do not reach ----------------------------------------------------------------------


@pytest.fixture
def elsewhere(tmp_path):
    """elsewhere(seconds): the file of a lock that a process on another host has touched so many seconds ago."""

    def elsewhere(seconds):
        path = tmp_path / ".results.porefv-lock"
        path.write_text(json.dumps({"host": "node17", "process": 4711, "since": "yesterday", "locked": True}))
        os.utime(path, (time.time() - seconds,) * 2)

    return elsewhere


def test_a_process_on_another_host_holds_its_lock_while_it_touches_its_file(elsewhere, tmp_path):
    elsewhere(locks.GONE / 3)
    with pytest.raises(InputError, match="process 4711 on node17, since yesterday"), locked(tmp_path / "results"):
        pass
    elsewhere(2 * locks.GONE)
    with locked(tmp_path / "results"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_without_locks_of_the_system_the_file_decides(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "fcntl", None)
    monkeypatch.setattr(locks, "TOUCHED", 0.05)
    monkeypatch.setattr(locks, "GONE", 0.4)
    with locked(tmp_path / "results"):
        for _ in range(5):
            time.sleep(0.2)
            locks.touch()
            with pytest.raises(InputError, match="being written"), locked(tmp_path / "results"):
                pass
    with locked(tmp_path / "results"):
        pass


def test_without_locks_of_the_system_a_process_that_is_gone_is_known_on_its_host(tmp_path, monkeypatch):
    monkeypatch.setattr(locks, "fcntl", None)
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    for host, refused in ((socket.gethostname(), False), ("node17", True)):
        holder = {"host": host, "process": process.pid, "since": "yesterday", "locked": False}
        (tmp_path / ".results.porefv-lock").write_text(json.dumps(holder))
        with pytest.raises(InputError, match="on node17") if refused else nullcontext(), locked(tmp_path / "results"):
            pass


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"\xff" * 10_000, b"{}"])
def test_a_damaged_file_of_a_lock_is_no_lock(tmp_path, content):
    (tmp_path / ".results.porefv-lock").write_bytes(content)
    with locked(tmp_path / "results"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_written_through_a_link(tmp_path):
    (tmp_path / "precious").write_text("mine")
    (tmp_path / ".results.porefv-lock").symlink_to("precious")
    with pytest.raises(InputError, match="cannot write"), locked(tmp_path / "results"):
        pass
    assert (tmp_path / "precious").read_text() == "mine"


def test_names_may_be_as_long_as_the_system_allows(tmp_path):
    for name in ("a" * 255, "ä" * 127):
        with atomic_directory(tmp_path / name) as folder:
            (folder / "summary.json").write_text("")
        assert [path.name for path in tmp_path.iterdir()] == [name]
        with atomic_directory(tmp_path / name, force=True):
            pass
        (tmp_path / name).rmdir()


# ---- what a kill leaves -----------------------------------------------------------------------------------------


def results(directory, value="old"):
    directory.mkdir()
    (directory / "summary.json").write_text(value)


def test_a_directory_that_was_about_to_be_replaced_is_put_back(tmp_path):
    results(tmp_path / ".results.porefv-old")
    put_back(tmp_path / "results")
    assert (tmp_path / "results" / "summary.json").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["results"]


def test_it_is_put_back_in_place_of_an_empty_one_and_of_no_other(tmp_path):
    results(tmp_path / ".results.porefv-old")
    (tmp_path / "results").mkdir()
    with locked(tmp_path / "results"):
        assert (tmp_path / "results" / "summary.json").read_text() == "old"
    results(tmp_path / ".others.porefv-old")
    (tmp_path / "others").mkdir()
    (tmp_path / "others" / "notes").write_text("mine")
    with locked(tmp_path / "others"):
        pass
    assert (tmp_path / "others" / "notes").exists() and (tmp_path / ".others.porefv-old" / "summary.json").exists()


def test_what_was_replaced_and_what_was_not_complete_is_removed(tmp_path):
    results(tmp_path / "results", "new")
    results(tmp_path / ".results.porefv-old")
    results(tmp_path / ".results.porefv-new")
    (tmp_path / ".results-0123456789ab").write_text("half")
    (tmp_path / ".results-0123456789ab.csv").write_text("of another file")
    with locked(tmp_path / "results"):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == [".results-0123456789ab.csv", "results"]
    assert (tmp_path / "results" / "summary.json").read_text() == "new"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_between_or_after_the_two_renamings(tmp_path, monkeypatch, number):
    rename = os.rename

    def interrupted(source, target):
        rename(source, target)
        if Path(source).name == at and not sent:
            sent.append(at)
            signal.raise_signal(number)

    monkeypatch.setattr(os, "rename", interrupted)
    for at, left in (("results", "old"), (".results.porefv-new", "new")):  # noqa: B007
        results(tmp_path / "results")
        sent = []
        with (
            pytest.raises((KeyboardInterrupt, Terminated)),
            handled(lambda number, _: end(number), *ENDING),
            atomic_directory(tmp_path / "results", force=True) as folder,
        ):
            (folder / "summary.json").write_text("new")
        with locked(tmp_path / "results"):
            assert (tmp_path / "results" / "summary.json").read_text() == left
        assert [path.name for path in tmp_path.iterdir()] == ["results"]
        shutil.rmtree(tmp_path / "results")


def test_what_stands_in_the_way_is_removed_whatever_it_is(tmp_path):
    new = tmp_path / ".results.porefv-new"
    (tmp_path / "precious").mkdir()
    for make in (new.touch, lambda: new.symlink_to("precious"), lambda: new.symlink_to("nowhere")):
        make()
        with atomic_directory(tmp_path / "results", force=True) as folder:
            (folder / "summary.json").write_text("{")
    results(tmp_path / ".results.porefv-old")
    (tmp_path / ".results.porefv-old" / "more").mkdir()
    (tmp_path / ".results.porefv-old" / "more").chmod(0o555)
    with locked(tmp_path / "results"):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["precious", "results"]


def test_results_of_another_program_are_not_replaced(tmp_path):
    results(tmp_path / "results", '{"mine": 1}')
    with pytest.raises(InputError, match="not results of porefv"), atomic_directory(tmp_path / "results", force=True):
        pass


def test_a_link_to_itself_is_no_place_for_results(tmp_path):
    (tmp_path / "results").symlink_to("results")
    with pytest.raises(InputError, match="a link to itself"), atomic_directory(tmp_path / "results"):
        pass
