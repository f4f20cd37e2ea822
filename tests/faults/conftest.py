"""Commands that are killed, or whose file system fails, at every operation on files."""

import errno
import io
import os
import shutil
import sys
import traceback
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass

import pytest

from porefv.cli.program import main

KILLED = 77
# Names of Python's audit events of file operations; of fsync there is none, it is replaced below.
OPERATIONS = {
    "open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.truncate", "os.listdir", "os.scandir", "os.utime",
    "fcntl.flock", "porefv.fsync",
}  # fmt: skip


def pytest_collection_modifyitems(items):
    """These tests first: copies of the process are made quickly while it is small."""
    items.sort(key=lambda item: "faults" not in item.path.parts)


@dataclass
class Outcome:
    """How a command ended in a process of its own, and what it said."""

    status: int
    said: str


def run(arguments, at=None, failure=None, folder=None):
    """Run a command in a copy of this process; the operation on files in a folder with that number goes wrong.

    Parameters
    ----------
    arguments : list of str
    at : int, optional
        Number of the operation, from 1.
    failure : int, optional
        Number of the error that the system gives; without it, the process is killed.
    folder : Path
        Other files are left in peace.
    """
    reader, writer = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(reader)
        said, status = io.StringIO(), 99
        try:
            if at is not None:
                inject(at, failure, os.fspath(folder))
            with redirect_stderr(said), redirect_stdout(io.StringIO()):
                status = main(arguments)
        except BaseException:
            said.write(traceback.format_exc())
        finally:
            os.write(writer, said.getvalue()[-5000:].encode())
            os._exit(status)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        said = pipe.read().decode()
    return Outcome(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), said)


def inject(at, failure, folder):
    """Have this process killed, or given an error, at an operation."""
    count, fsync = 0, os.fsync

    def audited_fsync(file):
        sys.audit("porefv.fsync", file)
        fsync(file)

    def hook(event, args):
        nonlocal count
        if event not in OPERATIONS or not args:
            return
        if not isinstance(args[0], int):
            path = os.fspath(args[0])
            if not (path if isinstance(path, str) else path.decode()).startswith(folder):
                return
        count += 1
        if count == at:
            if failure is None:
                os._exit(KILLED)
            raise OSError(failure, os.strerror(failure))

    os.fsync = audited_fsync
    sys.addaudithook(hook)


@pytest.fixture
def killed():
    """killed(arguments, at, folder): as `run`; the process must be killed before it ends."""

    def killed(arguments, at, folder):
        assert run(arguments, at, folder=folder).status == KILLED

    return killed


@pytest.fixture
def survives(tmp_path, capfd):
    """survives(arguments, prepare, check): a command goes wrong at each of its operations, and check finds no loss.

    Parameters
    ----------
    arguments : list of str
    prepare : function
        Fills an empty folder, which is the working directory of the commands.
    check : function
        Called with the folder after each command that was killed or has failed, to find what it must.
    failure : int, optional
        As of `run`.
    """

    def survives(arguments, prepare, check, failure=None):
        folder = tmp_path / "work"
        at = 0
        while True:
            at += 1
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            os.chdir(folder)
            prepare(folder)
            found = run(arguments, at, failure, folder)
            if found.status == 0 and failure is None:
                break
            where = f"operation {at} of {' '.join(arguments)}"
            if failure is None:
                assert found.status == KILLED, (where, found)
            else:
                assert found.status in (0, 1, 2), (where, found)
                if "defect" in found.said or "Traceback" in found.said:
                    pytest.fail(f"{where}: {found.said}")
            try:
                check(folder)
            except BaseException as error:
                error.add_note(f"{where}: {found}; {sorted(map(str, folder.rglob('*')))}")
                raise
            if failure is not None and at >= survives.count:
                break
        survives.count = at - 1 if failure is None else at
        with capfd.disabled():
            what = "killed" if failure is None else errno.errorcode[failure]
            print(f"\n{' '.join(arguments)}: {what} at each of {survives.count} operations", end="")

    survives.count = 0
    before = os.getcwd()
    yield survives
    os.chdir(before)
