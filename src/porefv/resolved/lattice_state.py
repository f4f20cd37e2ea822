"""SavedState: where a computation on lattices goes on after an interruption."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.resolved.lattice_boltzmann import StokesLattice
from porefv.resolved.reference import LatticeRun, Values
from porefv.system.atomic_files import atomic_write

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh


class SavedState:
    """A file that holds the lattices that are done, and the populations of the one at work.

    Parameters
    ----------
    path : path or None
        None: nothing is saved.
    mesh : PoreMesh
    walls : Walls
    numbers : list of float
        What else the computation depends on.

    Attributes
    ----------
    done : list of (Values, LatticeRun)

    Raises
    ------
    InputError
        If there is a file that cannot be read, or that is of another computation.
    """

    def __init__(self, path: str | PathLike[str] | None, mesh: PoreMesh, walls: Walls, numbers: list[float]):
        self.path = None if path is None else Path(path)
        self.done: list[tuple[Values, Any]] = []
        pressures = np.nan_to_num(walls.pressures, nan=-1.0)
        parts = [mesh.packing.centres.ravel(), mesh.packing.radii, mesh.box.wall_places, pressures, walls.slip, numbers]
        self._key = np.concatenate([np.asarray(part, float) for part in parts])
        self._found: dict[str, Any] = {}
        if self.path is not None and self.path.exists():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        try:
            with np.load(path, allow_pickle=False) as file:
                found = {name: file[name] for name in file.files}
            if not np.array_equal(found["key"], self._key):
                raise InputError(
                    f"{path} is the state of another computation: remove it to start anew, or run that one to its end"
                )
            names = [part.name for part in fields(Values)]
            for k in range(int(found["levels"])):
                values = Values(*(found[f"{name}_{k}"] for name in names))
                self.done.append((values, LatticeRun(**json.loads(str(found[f"run_{k}"])))))
        except (OSError, ValueError, KeyError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"cannot go on from {path}: {error}. Remove it to start anew") from None
        self._found = found

    def populations(self, number: int, flow: StokesLattice) -> tuple[int, float]:
        """Put those that were saved into a flow: the steps they took, 0 if there are none, and the last change."""
        found = self._found
        if found.get("number") != number or found["f"].shape != (19, len(flow.lattice)):
            return 0, float("nan")
        flow.f[:, : len(flow.lattice)] = found["f"]
        return int(found["steps"]), float(found["change"])

    def keep_level(self) -> None:
        """Save the lattices that are done."""
        if self.path is not None:
            self._write({})

    def keep_populations(self, number: int, flow: StokesLattice, steps: int, change: float) -> None:
        """Save those of the lattice at work, too."""
        if self.path is not None:
            self._write({"number": number, "steps": steps, "change": change, "f": flow.f[:, : len(flow.lattice)]})

    def _write(self, more: dict[str, Any]) -> None:
        assert self.path is not None
        content: dict[str, Any] = {"key": self._key, "levels": len(self.done)} | more
        for k, (values, run) in enumerate(self.done):
            content |= {f"{part.name}_{k}": getattr(values, part.name) for part in fields(Values)}
            content[f"run_{k}"] = json.dumps(asdict(run))
        with atomic_write(self.path) as temporary, temporary.open("wb") as file:
            np.savez(file, **content)

    def remove(self) -> None:
        """Remove the file: the computation is complete."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
