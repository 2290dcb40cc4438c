"""Cuts a sweep into parts, each measured and stored as a whole; the cut is always the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hertzchain.engines.lammps import Lammps
from hertzchain.engines.native import Native
from hertzchain.errors import SceneError
from hertzchain.limits import RTOL
from hertzchain.sweeps.design import Design

MOST_ROWS, MOST_PEAKS = 10_000, 500_000  # scenes and contacts of a part, chosen: about 30 MB
_WORK = 10.0  # time of a part on one core [s]; chosen: this is lost where a sweep is killed
_LEAST_PARTS = 16  # least number of parts; chosen, so that few scenes keep all cores busy
_START = 0.4  # estimated time below which no process is started [s]; chosen: two take 2 s to start
_LOOKED_AT = 500  # number of scenes whose granules are looked at
_BUILT = 20  # number of scenes from which the work of all is estimated; they have to be built
_GRANULES_BUILT = 50_000  # most granules of these scenes together, chosen: about a second
_ONE_BY_ONE = 20.0  # time of a native run with terms over that of a batch; measured: 3 to 50
_OVERHEAD = 2e-3  # additional time of a scene run by itself [s], measured


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
    granules = design.parameters(design.some(_LOOKED_AT))["chain.granules"]
    size = min(MOST_ROWS, MOST_PEAKS // int(np.max(granules)))
    size = min(size, math.floor(_WORK / _mean_seconds(design, backend)))
    if not is_batched(design, backend):
        size = min(size, math.ceil(design.scenes / _LEAST_PARTS))
    return max(size, 1)


def is_short(design: Design, backend: Backend) -> bool:
    """Return whether scenes take less than starting processes; never LAMMPS or given steps."""
    if isinstance(backend, Lammps) or (isinstance(backend, Native) and backend.dt is not None):
        return False
    return design.scenes * _mean_seconds(design, backend) < _START


def _mean_seconds(design: Design, backend: Backend) -> float:
    """Estimate the mean time of a scene on one core from some of them [s]."""
    numbers = design.some(max(2, min(_BUILT, _GRANULES_BUILT // design.base.chain.granules)))
    given = design.parameters(numbers)
    alone, times = (0.0, 1.0) if design.are_plain else (_OVERHEAD, _ONE_BY_ONE)
    if not isinstance(backend, Native):
        times = 1.0
    found = []
    for k in range(numbers.size):
        with suppress(SceneError):
            scene = design.scene(given, k)
            duration = scene.end_time / scene.contact_time
            found.append(alone + times * _seconds(backend, scene.chain.granules, duration))
    return float(np.mean(found)) if found else _OVERHEAD


def _seconds(backend: Backend, granules: int, duration: float) -> float:
    """Estimate the time of a scene by granules and duration [natural units] on one core [s]."""
    rtol = backend.rtol or RTOL
    if isinstance(backend, Native):
        a_step = {None: 2e-8 * (1e-4 / rtol) ** 0.25, "reference": 2e-6}  # measured
        cost = a_step.get(backend.method, 1e-5) if backend.dt is None else 1e-5
        return 1e-4 + duration * granules * cost
    step = 1.4e-3 * math.sqrt(rtol / 1e-6) * (6 if backend.extrapolated else 1)
    return 0.1 + 9 * duration / step * (0.5e-6 + 2e-8 * granules)


def settings(backend: Backend) -> dict[str, Any]:
    """Return all that identifies a backend, as a JSON object; a time limit changes no number."""
    of_runs = {"time_limit", "isolated", "peaks_only"}
    given = {field.name: getattr(backend, field.name) for field in fields(backend)}
    kept = {name: value for name, value in given.items() if name not in of_runs}
    if kept.get("lmp") is not None:
        kept["lmp"] = str(kept["lmp"])
    return {"name": NAMES[type(backend)], **kept}
