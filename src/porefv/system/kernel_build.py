"""Kernels that are compiled when the package is built, each for the signatures that are recorded.

The build runs this module in two processes, for the baseline of the processor's family (`kernel_files.BASELINE`):

    python -m porefv.system.kernel_build FOLDER

`tests/system/kernel_signatures.py` records the signatures that scenes need.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

RECORD = Path(__file__).with_name("kernel_signatures.json")
_PROCESSES = 2


def recorded() -> dict[str, list[str]]:
    """Signatures of each kernel, by module and name (`kernel_types`)."""
    return json.loads(RECORD.read_text(encoding="utf-8"))


def compile_recorded(kernels: dict[str, list[str]]) -> None:
    """Compile kernels for their signatures, or find them where they are kept.

    Raises
    ------
    ImportError, AttributeError, ValueError
        For a record of kernels, or named tuples, that are no longer there: record anew.
    """
    from porefv.system.kernel_types import types_from_text

    for name, signatures in kernels.items():
        module, _, function = name.rpartition(".")
        for signature in signatures:
            getattr(import_module(module), function).compile(types_from_text(signature))


def build(folder: Path) -> None:
    """Compile everything that is recorded, in two processes, into a folder that is emptied before."""
    from porefv.system import kernel_files

    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        path.unlink()
    # What compiling needs is set for these processes alone.
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder)}
    if platform.machine().lower() in ("x86_64", "amd64"):
        environment |= {"NUMBA_CPU_NAME": kernel_files.BASELINE, "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, "-m", __spec__.name, str(folder)]
    processes = [subprocess.Popen([*command, str(part)], env=environment) for part in range(_PROCESSES)]
    if any([process.wait() for process in processes]):
        raise SystemExit("kernels could not be compiled")
    kept = folder / kernel_files.KEPT
    for path in kept.iterdir():
        path.rename(folder / path.name)
    kept.rmdir()


def _build_part(part: int) -> None:
    """In one of the processes: compile its part of the modules, and say for what."""
    from porefv.system import kernel_files

    compile_recorded(_parts()[part])
    if part == 0:
        folder = kernel_files.kept_folder()
        assert folder is not None  # something has just been kept there
        (folder / kernel_files.BUILT_FOR).write_text(kernel_files.target_text(), encoding="utf-8")


def _parts() -> list[dict[str, list[str]]]:
    """The record in parts that take about as long: modules, the largest first, each to the part with the least code."""
    modules: dict[str, dict[str, list[str]]] = {}
    for name, signatures in recorded().items():
        modules.setdefault(name.rpartition(".")[0], {})[name] = signatures
    package = Path(__file__).resolve().parents[2]
    sizes = {name: (package / f"{name.replace('.', '/')}.py").stat().st_size for name in modules}
    parts: list[dict[str, list[str]]] = [{} for _ in range(_PROCESSES)]
    loads = [0] * _PROCESSES
    for name in sorted(modules, key=lambda name: -sizes[name]):
        lightest = loads.index(min(loads))
        parts[lightest] |= modules[name]
        loads[lightest] += sizes[name]
    return parts


def main(arguments: list[str]) -> Any:
    """FOLDER builds into it; FOLDER PART is one of the processes that do."""
    if len(arguments) == 1:
        build(Path(arguments[0]))
    else:
        _build_part(int(arguments[1]))


if __name__ == "__main__":
    main(sys.argv[1:])
