"""Every error and warning of porefv; the command line turns `exit_status` of an error into its exit code."""

from collections.abc import Iterable

# How options are named in errors that Python and the command line both show.
FORCE_OPTION = "force=True (--force on the command line)"
RESUME_OPTION = "resume=True (--resume on the command line)"


# Most characters of a message: what is quoted in it may be of any length.
_MOST = 2000


def printable(text: str, most: int | None = None) -> str:
    r"""A text with what is not printable escaped, line breaks excepted, and cut in its middle if it is too long.

    Names of files and contents of files may hold control characters, which would steer the terminal.

    >>> printable("a\x1b[31mb")
    'a\\x1b[31mb'
    """
    if most is not None and len(text) > most:
        text = f"{text[: most // 2]} ... {text[-most // 2 :]}"
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape", "surrogatepass").decode() for c in text
    )


class PorefvError(Exception):
    """Base of all errors raised on purpose by porefv. Its text is printable, and bounded in length."""

    exit_status = 1

    def __str__(self) -> str:
        return printable(super().__str__(), _MOST)


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


class PackingFileWarning(PorefvWarning):
    """Something in a packing file was not read, or was read in a way that the user may not expect."""


class ImbalanceWarning(PorefvWarning):
    """A pressure that was found elsewhere leaves more of the flow out of balance than rounding explains."""


class FreeSpaceWarning(PorefvWarning):
    """There is more room between a wall and the grains than between grains."""


class NoOpenPathWarning(PorefvWarning):
    """No open path leads from the inlet of a sample to its outlet: no fluid passes."""


class OutOfRangeWarning(PorefvWarning):
    """Much of a flow is in throats of a kind that the conductance model was not tested on."""


class InertiaWarning(PorefvWarning):
    """The inertia of the fluid matters, which a viscous flow leaves out."""


class LooseStateWarning(PorefvWarning):
    """Grains are so far apart that they need resistance of pairs, which is off."""


class TransportWarning(PorefvWarning):
    """An equation on the fluid has a term or a condition that mostly is not what is meant."""


def vector(values: Iterable[float]) -> str:
    """Coordinates as shown in an error: ``0.5, 1, 0.25``."""
    return ", ".join(f"{value:.9g}" for value in values)


def counted(number: int, noun: str) -> str:
    """``1 sphere``, ``2000 spheres``, ``12 627 pores``."""
    digits = f"{number:,}".replace(",", " ") if number >= 10_000 else str(number)
    return f"{digits} {noun}" + ("" if number == 1 else "s")
