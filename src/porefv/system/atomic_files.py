"""Files and directories that appear whole or not at all."""

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path

from porefv.errors import FORCE_OPTION, InputError

# A directory that holds this file is a results directory, and may be replaced by a new one.
RESULTS_MARK = "summary.json"


@contextmanager
def atomic_write(path: str | PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; what is written there replaces `path` if the block succeeds.

    If the block fails nothing is left behind, and a file that existed is untouched.

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
        os.replace(temporary, target)
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def picture_target(path: str | PathLike[str]) -> Path:
    """The path of a picture to be drawn; InputError, before it is, if no PNG file can be written there."""
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise InputError(f"cannot write {path}: pictures are PNG files; give a name that ends in .png")
    if not path.absolute().parent.is_dir():
        raise InputError(f"cannot write {path}: there is no directory {path.absolute().parent}")
    return path


@contextmanager
def atomic_directory(path: str | PathLike[str], force: bool = False) -> Iterator[Path]:
    """Yield an empty temporary directory beside `path`, which becomes `path` if the block succeeds.

    If the block fails nothing is left behind, and what existed is untouched.

    Parameters
    ----------
    path : path
        Directory to make, with its parents. It may exist if it is empty.
    force : bool
        Replace an existing results directory, with all it holds. Other directories are never replaced.

    Raises
    ------
    InputError
        If the directory is not empty and may not be replaced, or cannot be written. Raised before the block
        runs, where possible.
    """
    target = Path(os.path.realpath(path))
    temporary = _sibling(target)
    parents: list[Path] = []
    try:
        _check_directory(path, target, force)
        parents += [parent for parent in target.parents if not parent.exists()]
        temporary.mkdir(parents=True)
        yield temporary
        _check_directory(path, target, force)
        _swap(temporary, target)
        parents.clear()
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        for parent in parents:
            with suppress(OSError):
                parent.rmdir()


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
    if content and RESULTS_MARK not in content:
        raise InputError(f"{path} holds files that are not results of porefv. Choose another directory.")
    if content and not force:
        raise InputError(
            f"{path} already holds results. Choose another directory, or replace them with {FORCE_OPTION}."
        )


def _swap(temporary: Path, target: Path) -> None:
    """Put a directory in place of another; if that fails, the old one is put back."""
    old = _sibling(target) if target.exists() else None
    if old:
        os.rename(target, old)
    try:
        os.rename(temporary, target)
    except BaseException:
        if old:
            os.rename(old, target)
        raise
    if old:
        shutil.rmtree(old, ignore_errors=True)


def _sibling(target: Path) -> Path:
    """A hidden name in the same directory with the same extension, which some writers go by.

    It is not created here, so that what is written there gets the usual permissions.
    """
    return target.parent / f".{target.stem[:100]}-{uuid.uuid4().hex[:12]}{target.suffix}"


def _cannot_write(path: str | PathLike[str], error: OSError) -> InputError:
    # What failed may be another file than `path`, so that the reason alone would mislead.
    return InputError(f"cannot write {path}: {error}.")
