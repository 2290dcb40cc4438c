"""Cuts a sweep into parts, each measured and stored as a whole; the cut is always the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.native.backend import Native
from hertzchain.sweeps.design import Design

MOST_ROWS, MOST_PEAKS = 10_000, 500_000  # scenes and contacts of a part, chosen: about 30 MB
_ALONE = 50  # scenes of a part that are run one by one; chosen: a kill loses as many
_LEAST_PARTS = 16  # least number of parts; chosen, so that few scenes keep all cores busy
_LOOKED_AT = 500  # number of scenes whose granules are counted
_SHORT, _SMALL = 400_000, 60
"""Scenes times granules squared, at least those of a small chain, below which no process is started
(chosen): two take 2 s to start, and 110 scenes of 60 granules less than that.
"""

Backend = Native | Lammps

KINDS: dict[str, type[Backend]] = {"native": Native, "lammps": Lammps}
"""Names of the backends in the table."""

NAMES: dict[type, str] = {kind: name for name, kind in KINDS.items()}


@dataclass(frozen=True)
class Part:
    """Scenes from ``start`` to before ``stop``, measured by one backend and stored together."""

    name: str
    backend: Backend
    start: int
    stop: int


def cut(design: Design, backends: Sequence[Backend]) -> Iterator[Part]:
    """Yield the parts of a sweep, one backend after another."""
    for backend in backends:
        size = part_size(design, backend)
        starts = range(0, design.scenes, size)
        digits = max(4, len(str(len(starts) - 1)))
        for number, start in enumerate(starts):
            name = f"{NAMES[type(backend)]}-{number:0{digits}d}"
            yield Part(name, backend, start, min(start + size, design.scenes))


def is_batched(design: Design, backend: Backend) -> bool:
    """Return whether the compiled batch takes these scenes: single pulses, default end time."""
    if not isinstance(backend, Native) or backend.method is not None or backend.dt is not None:
        return False
    varies = any(axis.name == "run.end_time" for axis in design.axes)
    fits = design.are_plain and design.base.pulse is not None
    return fits and not varies and design.base.run.end_time is None


def part_size(design: Design, backend: Backend) -> int:
    """Return the number of scenes in a part."""
    size = min(MOST_ROWS, MOST_PEAKS // _largest(design))
    if not is_batched(design, backend):
        size = min(size, _ALONE, math.ceil(design.scenes / _LEAST_PARTS))
    return max(size, 1)


def is_short(design: Design, backend: Backend) -> bool:
    """Return whether scenes are few and chains short, and one process is enough.

    LAMMPS and given steps take longer than starting processes.
    """
    if isinstance(backend, Lammps) or backend.dt is not None or backend.method is not None:
        return False
    return design.scenes * max(_largest(design), _SMALL) ** 2 < _SHORT


def _largest(design: Design) -> int:
    """Return the granules of the longest chain of some scenes."""
    some = np.linspace(0, design.scenes - 1, min(design.scenes, _LOOKED_AT)).astype(np.int64)
    return int(np.max(design.parameters(some)["chain.granules"]))


def settings(backend: Backend) -> dict[str, Any]:
    """Return the settings of a backend that change numbers, as a JSON object."""
    of_runs = {"time_limit", "isolated", "peaks_only"}
    given = {field.name: getattr(backend, field.name) for field in fields(backend)}
    kept = {name: value for name, value in given.items() if name not in of_runs}
    if kept.get("lmp") is not None:
        kept["lmp"] = str(kept["lmp"])
    return {"name": NAMES[type(backend)], **kept}
