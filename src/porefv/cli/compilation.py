"""What a command says when it waits for kernels to be compiled."""

from __future__ import annotations

# numba is imported from here, where few functions are on the stack. CPython 3.11 allocates memory when calls cross a
# multiple of 16 kB of stack, and frees it when they return. A loop of numba's that happens to be there, within many
# imports of ours, does so 15 000 times, which takes 0.15 s.
import numba  # noqa: F401

from porefv.system.progress import Progress


def announce_compilation(progress: Progress) -> None:
    """Say so when a kernel is compiled that was neither built with the package nor kept from an earlier run."""
    from porefv.system.kernel_files import on_compilation

    on_compilation(progress.note)
