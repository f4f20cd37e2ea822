"""Every error and warning of porefv; the command line turns `exit_status` of an error into its exit code."""

from collections.abc import Iterable

# How options are named in errors that Python and the command line both show.
FORCE_OPTION = "force=True (--force on the command line)"
RESUME_OPTION = "resume=True (--resume on the command line)"


class PorefvError(Exception):
    """Base of all errors raised on purpose by porefv."""

    exit_status = 1


class InputError(PorefvError, ValueError):
    """Bad input. The message names the file, the line or the sphere id, and the remedy."""

    exit_status = 2


class ComputationError(PorefvError, RuntimeError):
    """Sound input, but the computation failed (a solver that does not converge, say)."""

    exit_status = 1


class MissingExtraError(InputError, ImportError):
    """An optional package is needed and not installed.

    Parameters
    ----------
    package : str
        Name of the package on PyPI, as given to pip.
    purpose : str
        What needs it, as the start of a sentence: ``"Reading VTK files"``.
    """

    def __init__(self, package: str, purpose: str):
        # The two arguments stay in `args`, so that the error survives pickling.
        super().__init__(package, purpose)
        self.package = package
        self.purpose = purpose

    def __str__(self) -> str:
        return (
            f"{self.purpose} needs the package {self.package}, which is not installed. "
            f"Install it with: pip install {self.package}"
        )


class PorefvWarning(UserWarning):
    """Base of all warnings of porefv."""


class CompilationWarning(PorefvWarning):
    """Compiled kernels cannot be kept: they are compiled anew in every process."""


class ImbalanceWarning(PorefvWarning):
    """A pressure that was found elsewhere leaves more of the flow out of balance than rounding explains."""


def vector(values: Iterable[float]) -> str:
    """Coordinates as shown in an error: ``0.5, 1, 0.25``."""
    return ", ".join(f"{value:.9g}" for value in values)


def counted(number: int, noun: str) -> str:
    """``1 sphere``, ``2000 spheres``, ``12 627 pores``."""
    digits = f"{number:,}".replace(",", " ") if number >= 10_000 else str(number)
    return f"{digits} {noun}" + ("" if number == 1 else "s")
