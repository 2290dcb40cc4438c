"""What LAMMPS makes of somebody's deck without motion: granules, contacts, forces over its runs.

No scene is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps.isolation import Child
from hertzchain.engines.lammps.reading.found import Executed, FoundRun
from hertzchain.engines.lammps.reading.frozen import Applied
from hertzchain.engines.lammps.reading.granules import Granules
from hertzchain.engines.lammps.reading.prober import Sizes
from hertzchain.engines.lammps.reading.probing import Probes
from hertzchain.engines.lammps.reading.reading import First, Source, Start, without_motion
from hertzchain.engines.lammps.reading.session import Stage
from hertzchain.errors import HertzchainError

_READ_EVERY = 0.2  # contact times between two readings of the forces (chosen)
_MOST_GRANULES = 2000  # of a chain whose runs are played (chosen)


@dataclass(frozen=True, eq=False)
class Look:
    """What LAMMPS makes of a deck: of a chain all of it, of others what stands before a run."""

    commands: tuple[Executed, ...]  # as they were carried out
    stopped: str  # why LAMMPS stopped behind them; empty where it did not
    probes: Probes | None = None  # before the first run; None where there is none
    runs: tuple[FoundRun, ...] = ()
    applied: Applied | None = None  # forces during these runs; None where it is no chain

    @property
    def is_whole(self) -> bool:
        """Whether the deck was carried out to its end."""
        return not self.stopped and (self.probes is None or self.applied is not None)

    @property
    def granules(self) -> Granules | None:
        """The granules before the first run; None where there are none."""
        return None if self.probes is None else self.probes.granules

    @property
    def law(self) -> tuple[FloatArray, FloatArray] | None:
        """A and p in F = A d^p of each contact, by its two largest overlaps; None if unknown."""
        probes = self.probes
        if probes is None or probes.why_not is not None:
            return None
        with np.errstate(all="ignore"):  # NaN where a contact has no force
            force, overlap = (np.log(each[-2:]) for each in (probes.contact_force, probes.overlap))
            exponent = np.diff(force, axis=0)[0] / np.diff(overlap, axis=0)[0]
            return np.exp(force[-1] - exponent * overlap[-1]), exponent


def look(path: Path, variables: Mapping[str, str], time_limit: float) -> Look:
    """Have LAMMPS look at a deck in a process of its own.

    Raises BackendMissing without a LAMMPS module, RunFailed if it crashes, TooExpensive if it is
    not done in time [s].
    """
    with work_folder("LAMMPS") as folder, Child() as child:
        found: Look = child.call(
            looked, Start(folder, None), path, Path.cwd(), dict(variables), time_limit=time_limit
        )
    return found


def looked(start: Start, path: Path, folder: Path, variables: Mapping[str, str]) -> Look:
    """The same in this process."""
    source = Source(str(path), folder / path, folder, variables)
    with start.session() as lammps:
        first = First(Stage(lammps), Sizes())
        script, stopped = source.played_by(first, lammps), ""
        try:
            script.play()
        except HertzchainError as problem:
            stopped = str(problem)
    probes = first.probes
    if probes is None or not 1 < probes.granules.count <= _MOST_GRANULES:
        return Look(tuple(script.commands), stopped, probes)
    if not probes.granules.is_chain:
        return Look(tuple(script.commands), stopped, probes)
    nobody = np.zeros(probes.granules.count, bool)
    seen, applied = without_motion(start, source, probes, _READ_EVERY * probes.contact_time, nobody)
    return Look(seen.commands, seen.stopped, probes, tuple(seen.runs), applied)
