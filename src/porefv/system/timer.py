"""Timer: the wall time of a block of code, added to a dictionary of times."""

from __future__ import annotations

import time


class Timer:
    """Adds the wall time of a block to an entry of a dictionary, also when the block ends with an error.

    Parameters
    ----------
    seconds : dict of str to float
        Wall time by name [s]. The entry is made when the block ends, if there is none.
    name : str
        Of the entry.

    Examples
    --------
    >>> seconds = {}
    >>> with Timer(seconds, "reading"):
    ...     pass
    >>> list(seconds)
    ['reading']
    """

    def __init__(self, seconds: dict[str, float], name: str):
        self._seconds, self._name = seconds, name
        self._begin = 0.0

    @property
    def elapsed(self) -> float:
        """Wall time since the block began [s]."""
        return time.perf_counter() - self._begin

    def __enter__(self) -> Timer:
        self._begin = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self._seconds[self._name] = self._seconds.get(self._name, 0.0) + self.elapsed
