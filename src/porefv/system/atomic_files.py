"""Files and directories that appear whole or not at all."""

import json
import os
import re
import shutil
import stat
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from os import PathLike
from pathlib import Path

from porefv.errors import FORCE_OPTION, InputError
from porefv.system.locks import hidden_sibling, lock

# A directory that holds this file is a results directory, and may be replaced by a new one.
RESULTS_MARK = "summary.json"

_TEMPORARY = re.compile(r"\.(?P<stem>.+)-[0-9a-f]{12}(?P<suffix>\.[^.]+)?", re.DOTALL)


@contextmanager
def locked(path: str | PathLike[str]) -> Iterator[None]:
    """Let no other process write a file or directory while the block runs; see `porefv.system.locks`.

    What a process that was killed has left of it is put right first: a directory that was about to be replaced is put
    back, and what was not complete is removed.

    Raises
    ------
    InputError
        If another process is writing it, or it cannot be written.
    """
    target = Path(os.path.realpath(path))
    check_is_no_root(path)
    if os.path.islink(target):
        raise InputError(f"cannot write {path}: it is a link to itself. Give another place")
    with ExitStack() as stack:
        try:
            stack.enter_context(lock(target))
            _recover(target)
        except OSError as error:
            raise _cannot_write(path, error) from error
        yield


def check_is_no_root(path: str | PathLike[str]) -> None:
    """InputError if a path is the root of the file system, which nothing can be written in place of."""
    target = Path(os.path.realpath(path))
    if target.parent == target:
        raise InputError(f"cannot write {path}: it is the root of the file system. Give another place")


def put_back(path: str | PathLike[str]) -> None:
    """Put a directory back that a process was about to replace when it was killed; else, do nothing."""
    target = Path(os.path.realpath(path))
    if not os.path.lexists(target) and os.path.lexists(hidden_sibling(target, "old")):
        # Where this cannot be written, or another process is about to do the same, it stays as it is.
        with suppress(InputError), locked(target):
            pass


def finished_name(name: str) -> str | None:
    """What the file of a temporary name was to be called; None if it is not a temporary name of `atomic_write`."""
    found = _TEMPORARY.fullmatch(name)
    return None if found is None else found["stem"] + (found["suffix"] or "")


def sync_directory(path: Path) -> None:
    """Have names in a directory outlast a loss of power, where the system can."""
    with suppress(OSError):
        directory = os.open(path, os.O_RDONLY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)


@contextmanager
def atomic_write(path: str | PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; what is written there replaces `path` if the block succeeds.

    If the block fails nothing is left behind, and a file that existed is untouched. Afterwards the file outlasts a
    loss of power.

    Raises
    ------
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> with atomic_write("forces.csv") as temporary:
    ...     _ = temporary.write_text("id,fx,fy,fz")
    """
    target = Path(os.path.realpath(path))
    temporary = _sibling(target)
    try:
        _check_file(path, target)
        yield temporary
        _sync_file(temporary)
        os.replace(temporary, target)
        sync_directory(target.parent)
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def picture_target(path: str | PathLike[str], endings: tuple[str, ...] = (".png",)) -> Path:
    """The path of a picture to be drawn; InputError, before it is, if no such file can be written there.

    Parameters
    ----------
    path : path
    endings : tuple of str
        Of the formats that the picture can have.
    """
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise InputError(f"cannot write {path}: give a name that ends in {' or '.join(endings)}")
    if not path.absolute().parent.is_dir():
        raise InputError(f"cannot write {path}: there is no directory {path.absolute().parent}")
    return path


@contextmanager
def atomic_directory(path: str | PathLike[str], force: bool = False) -> Iterator[Path]:
    """Yield an empty temporary directory beside `path`, which becomes `path` if the block succeeds.

    If the block fails nothing is left behind, and what existed is untouched. No other process writes the directory
    meanwhile. Afterwards the directory outlasts a loss of power.

    Parameters
    ----------
    path : path
        Directory to make, with its parents. It may exist if it is empty.
    force : bool
        Replace an existing results directory, with all it holds. Other directories are never replaced.

    Raises
    ------
    InputError
        If the directory is not empty and may not be replaced, is being written by another process, or cannot be
        written. Raised before the block runs, where possible.
    """
    target = Path(os.path.realpath(path))
    new = hidden_sibling(target, "new")
    with locked(path):
        try:
            _check_directory(path, target, force)
            new.mkdir()
            yield new
            _check_directory(path, target, force)
            _sync_tree(new)
            _swap(new, target)
        except OSError as error:
            raise _cannot_write(path, error) from error
        finally:
            if new.exists():
                _remove(new)


def _check_file(path: str | PathLike[str], target: Path) -> None:
    """Refuse to replace what is not a file to be replaced."""
    if target.is_dir():
        raise InputError(f"cannot write {path}: it is a directory.")
    # Replacing a device or a pipe would destroy it; replacing a read-only file would ignore its owner's wish.
    if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
        raise InputError(f"cannot write {path}: it is write-protected or not a regular file.")


def _check_directory(path: str | PathLike[str], target: Path, force: bool) -> None:
    """Refuse to replace what is not an empty directory or, if forced, a results directory."""
    if not target.exists():
        return
    if not target.is_dir():
        raise InputError(f"cannot write the directory {path}: a file of that name exists.")
    content = os.listdir(target)
    if content and not (RESULTS_MARK in content and _is_ours(target / RESULTS_MARK)):
        old = hidden_sibling(target, "old")
        earlier = f" Earlier results are in {old}." if old.exists() else ""
        raise InputError(f"{path} holds files that are not results of porefv. Choose another directory.{earlier}")
    if content and not force:
        raise InputError(
            f"{path} already holds results. Choose another directory, or replace them with {FORCE_OPTION}."
        )
    # Found now, not when all is computed.
    parent = target.parent.stat()
    if os.path.ismount(target):
        raise InputError(f"cannot replace {path}: it is a mount point. Give a directory within it.")
    if not os.access(target, os.W_OK) or (
        os.name == "posix"
        and parent.st_mode & stat.S_ISVTX
        and os.geteuid() not in (0, parent.st_uid, target.stat().st_uid)
    ):
        raise InputError(f"cannot replace {path}: it is write-protected, or another user's. Choose another directory.")


def _is_ours(mark: Path) -> bool:
    """Whether the summary of a directory may be one of porefv's: what is damaged may be."""
    try:
        found = json.loads(mark.read_bytes())
    except (OSError, ValueError, RecursionError):
        return True
    return isinstance(found, dict) and ("versions" in found or found.get("kind") == "trade")


def _swap(new: Path, target: Path) -> None:
    """Put a directory in place of another; if that fails, the old one is put back, now or by `_recover`."""
    old = hidden_sibling(target, "old") if target.exists() else None
    if old:
        os.rename(target, old)
    try:
        os.rename(new, target)
    finally:  # whatever came: a signal may have come after the renaming
        if old and not target.exists():
            os.rename(old, target)
    sync_directory(target.parent)
    if old:
        _remove(old)


def _recover(target: Path) -> None:
    """Put right what a process that was killed has left of a file or directory."""
    old, new = (hidden_sibling(target, ending) for ending in ("old", "new"))
    if old.exists():
        if target.is_dir() and not os.listdir(target):
            target.rmdir()
        if not target.exists():
            os.rename(old, target)
        elif (target / RESULTS_MARK).exists():
            _remove(old)
    if os.path.lexists(new):
        _remove(new)
    for name in os.listdir(target.parent):
        if finished_name(name) == target.stem[:100] + target.suffix and (target.parent / name).is_file():
            (target.parent / name).unlink()


def _remove(path: Path) -> None:
    """Remove what is left of a directory, or what stands in its place.

    Raises
    ------
    InputError
        If it cannot be removed; names it.
    """
    try:
        if path.is_symlink() or not path.is_dir():
            path.unlink()
            return
        for directory, _, _ in os.walk(path):  # from the top: where one is write-protected, it may be unlocked
            if not os.access(directory, os.W_OK):
                os.chmod(directory, 0o700)
        shutil.rmtree(path)
    except OSError as error:
        raise InputError(
            f"cannot remove {path}, which is left of an earlier run: {error.strerror}. Remove it"
        ) from None


def _sync_file(path: Path) -> None:
    """Have the content of a file outlast a loss of power."""
    file = os.open(path, os.O_RDWR)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _sync_tree(folder: Path) -> None:
    for directory, _, names in os.walk(folder):
        for name in names:
            _sync_file(Path(directory) / name)
        sync_directory(Path(directory))


def _sibling(target: Path) -> Path:
    """A hidden name in the same directory with the same extension, which some writers go by.

    It is not created here, so that what is written there gets the usual permissions.
    """
    return target.parent / f".{target.stem[:100]}-{uuid.uuid4().hex[:12]}{target.suffix}"


def _cannot_write(path: str | PathLike[str], error: OSError) -> InputError:
    # What failed may be another file than `path`, so that the reason alone would mislead.
    return InputError(f"cannot write {path}: {error}.")
