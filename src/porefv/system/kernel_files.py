"""Where compiled kernels are: beside the package as it was built, or kept from an earlier run, one file each.

A file's name is a digest of all that its machine code depends on: the code of the kernel and of the helpers it calls,
constants, types, options, numba, Python and the processor. So what was compiled from other sources, or for another
machine, is never found. A file that is damaged is compiled anew. Nothing of numba itself is changed.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import caching
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from porefv.errors import CompilationWarning
from porefv.system.kernel_types import types_text

# Compiled when the package was built; there is none in a working copy.
BUILT = Path(__file__).resolve().parents[1] / "compiled_kernels"
# The processors that kernels are built for where these features are there: x86-64-v3, of 2013 and later.
BASELINE = "x86-64-v3"
_BASELINE_FEATURES = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.2")
_ENDING = ".kernel"
# The folder, in one that may have others' files, where kernels are kept that are compiled at their first use.
KEPT = "porefv-kernels"
# In the folder of those that were built: the versions and the processor that it was built for, a line each.
BUILT_FOR = "built_for.txt"


class KernelFiles(caching._Cache):
    """The compiled versions of one kernel on disk, one for each signature: what numba calls the cache of a function."""

    def __init__(self, kernel: Any):
        self._kernel = kernel
        self._enabled = True

    @property
    def cache_path(self) -> str | None:
        """Where new ones are kept."""
        folder = kept_folder()
        return None if folder is None else str(folder)

    def enable(self) -> None:
        """Keep and find compiled kernels."""
        self._enabled = True

    def disable(self) -> None:
        """Neither keep nor find any."""
        self._enabled = False

    def flush(self) -> None:
        """Forget what was kept of this kernel; numba calls it where a kernel is to be compiled anew."""
        folder = kept_folder()
        for path in folder.glob(f"{self._name}-*{_ENDING}") if folder else ():
            path.unlink(missing_ok=True)

    def load_overload(self, signature: Any, target_context: Any) -> CompileResult | None:
        """The compiled kernel for a signature, or None where it is still to be compiled."""
        if not self._enabled:
            return None
        # What kernels need when they run. numba's own cache refreshes all that compiling needs, which takes longer
        # than most computations.
        rtsys.initialize(target_context)
        for path in self._files(signature, target_context):
            content = _read(path)
            if content is not None:
                return CompileResult._rebuild(target_context, *pickle.loads(content))
        announce()
        return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep a compiled kernel, where there is room."""
        if not self._enabled:
            return
        folder = kept_folder()
        if folder is None:
            _warn("no directory for them can be written to")
            return
        try:
            path = folder / self._file_name(signature, _processor(compiled.target_context))
            write_kernel(path, dumps(compiled._reduce()))
        except OSError as error:
            self.disable()
            _warn(error.strerror or type(error).__name__)

    @property
    def _name(self) -> str:
        function = self._kernel.py_func
        return f"{function.__module__.removeprefix('porefv.')}.{function.__qualname__}"

    def _files(self, signature: Any, target_context: Any) -> Iterator[Path]:
        """Where the compiled kernel may be, the best first."""
        own = self._file_name(signature, _processor(target_context))
        if BUILT.is_dir():
            if _has_baseline():
                yield BUILT / self._file_name(signature, BASELINE)
            yield BUILT / own
        folder = kept_folder()
        if folder is not None:
            yield folder / own

    def _file_name(self, signature: Any, processor: str) -> str:
        arguments = getattr(signature, "args", signature)
        digest = hashlib.sha256(
            "\n".join((_versions(), processor, stamp(self._kernel), types_text(arguments))).encode()
        )
        return f"{self._name}-{digest.hexdigest()[:24]}{_ENDING}"


# ---- files ------------------------------------------------------------------------------------------------------


def write_kernel(path: Path, content: bytes) -> None:
    """Write a file whole or not at all: content after its digest."""
    handle, name = tempfile.mkstemp(prefix=".", suffix=_ENDING, dir=path.parent)
    try:
        with open(handle, "wb") as file:
            file.write(hashlib.sha256(content).digest() + content)
        os.chmod(name, 0o644)  # others who use the package may load it
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def _read(path: Path) -> bytes | None:
    """What a file holds; None where it is not there, or damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    digest, content = data[:32], data[32:]
    if hashlib.sha256(content).digest() != digest:
        warnings.warn(f"the compiled kernel {path} is damaged; it is compiled anew", CompilationWarning, stacklevel=1)
        return None
    return content


@cache
def kept_folder() -> Path | None:
    """Where kernels are kept that are compiled at their first use; None where nothing can be written.

    The directory that NUMBA_CACHE_DIR names, or one beside the package, or one of the user's. Whoever can write there
    can make porefv run any code: a directory that others may write to is left out.
    """
    for folder in _folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        if _others_may_write(folder):
            warnings.warn(
                f"{folder} can be written to by other users, who could put any code there: no kernels are kept in it. "
                f"Take that right away (chmod go-w {folder}), or name a directory of your own in NUMBA_CACHE_DIR",
                CompilationWarning,
                stacklevel=1,
            )
            continue
        return folder
    return None


def _others_may_write(folder: Path) -> bool:
    """Whether users besides this one, and the administrator, may write to a directory."""
    if os.name != "posix":
        return False
    found = folder.stat()
    return bool(found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)) or found.st_uid not in (os.geteuid(), 0)


def _folders() -> Iterator[Path]:
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        yield Path(named) / KEPT
        return
    yield Path(__file__).resolve().parents[1] / "__pycache__" / KEPT
    from numba.misc.appdirs import AppDirs

    yield Path(AppDirs(appname="porefv", appauthor=False).user_cache_dir) / KEPT


@cache
def _warn(reason: str) -> None:
    """Once in a process: numba makes Python forget which warnings it has shown."""
    warnings.warn(
        f"compiled kernels cannot be kept ({reason}): every process compiles anew, for a minute. "
        "Name a directory of your own with room, that nobody else can write to, in the variable NUMBA_CACHE_DIR",
        CompilationWarning,
        stacklevel=1,
    )


# ---- saying that something is compiled --------------------------------------------------------------------------

_tell: Callable[[str], None] | None = None


def on_compilation(tell: Callable[[str], None] | None) -> None:
    """Have a function told, in a sentence, when the first kernel is about to be compiled in this process.

    Without one, a package that was built for another machine, or for another version of numba, warns.
    """
    global _tell
    _tell = tell


@cache
def announce() -> None:
    """Say, once in a process, that something is compiled."""
    reason = _why_not_built()
    sentence = "compiling for this machine, this once; it takes about half a minute"
    if reason:
        sentence += f" ({reason})"
    if _tell is not None:
        _tell(sentence)
    elif reason:
        warnings.warn(sentence, CompilationWarning, stacklevel=1)


def _why_not_built() -> str:
    """Why what the package was built with does not serve; nothing where it was not built."""
    try:
        versions, processor = (BUILT / BUILT_FOR).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return ""
    if versions != _versions():
        return f"porefv was built for {versions}; this is {_versions()}"
    if processor == BASELINE and not _has_baseline():
        return f"porefv was built for processors like {BASELINE}, with AVX2 and FMA"
    return "for arguments that porefv was not built for"


# ---- what machine code depends on -------------------------------------------------------------------------------


@cache
def _versions() -> str:
    return f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, {sys.implementation.cache_tag} {sys.platform}"


def _processor(target_context: Any) -> str:
    """The processor that numba compiles for, with its features; the baseline is known by its name."""
    triple, name, features = target_context.codegen().magic_tuple()
    return name if name == BASELINE else f"{triple} {name} {features}"


def target_text() -> str:
    """Versions, and the processor that numba compiles for, as the file `BUILT_FOR` has them."""
    from numba.core.registry import cpu_target

    return f"{_versions()}\n{_processor(cpu_target.target_context)}\n"


@cache
def _has_baseline() -> bool:
    features = llvm.get_host_cpu_features()
    return all(features.get(feature, False) for feature in _BASELINE_FEATURES)


@cache
def stamp(kernel: Any) -> str:
    """Digest of the code of a kernel and of all that it calls, with the constants they use."""
    digest = hashlib.sha256()
    for part in _parts(kernel, set()):
        digest.update(part.encode())
    return digest.hexdigest()


def _parts(compiled: Any, seen: set[Any]) -> Iterator[str]:
    if compiled in seen:
        return
    seen.add(compiled)
    function = compiled.py_func
    # Sets have another order in every process.
    options = {key: sorted(value) if isinstance(value, set) else value for key, value in compiled.targetoptions.items()}
    yield f"{function.__qualname__} {sorted(options.items())}"
    names: set[str] = set()
    yield from _code(function.__code__, function.__doc__, names)
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    values = {name: function.__globals__[name] for name in names if name in function.__globals__}
    values |= {name: cell.cell_contents for name, cell in cells}
    for name, value in sorted(values.items()):
        if isinstance(value, Dispatcher):
            yield from _parts(value, seen)
        elif isinstance(value, np.ndarray):
            yield f"{name} {value.dtype} {value.shape} {value.tobytes().hex()}"
        elif isinstance(value, type):
            yield f"{name} {value.__qualname__} {getattr(value, '_fields', '')}"
        elif not isinstance(value, (ModuleType, FunctionType)):
            yield f"{name} {value!r}"


def _code(code: CodeType, docstring: str | None, names: set[str]) -> Iterator[str]:
    """What a function does, without its docstring; names that it uses are added to `names`."""
    names.update(code.co_names)
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars}"
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant, None, names)
        elif constant is not docstring:
            yield repr(constant)
