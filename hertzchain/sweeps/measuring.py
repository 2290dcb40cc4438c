"""Measures the scenes of a sweep, part by part."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.engines.native.backend import Native
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed, TooExpensive
from hertzchain.limits import RTOL, usable_cores
from hertzchain.scene.chain import granule_mass
from hertzchain.scene.natural_units import MOMENTUM_IN_NATURAL_UNITS, length_and_time
from hertzchain.scene.pulse import profile_named
from hertzchain.scene.scene import Scene
from hertzchain.scene.watching import watched_time
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.parts import NAMES, Backend, Part, is_batched
from hertzchain.sweeps.table import Rows

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.lammps.isolation import Child
    from hertzchain.engines.native.batch import Batch
    from hertzchain.observables.result import Result

YEAR = 3e7  # default: no time limit [s]
_LONG = 1e8  # natural time units times granules, about 1 s: longer scenes run by themselves


@dataclass(frozen=True, eq=False)
class Measured:
    """Tables of a part: one row per scene and, where wanted, one per scene and contact."""

    table: pandas.DataFrame
    peaks: pandas.DataFrame | None


def measure(
    design: Design,
    part: Part,
    peaks: bool,
    cores: int | None = None,
    child: Child | None = None,
    report_progress: Callable[[int], None] = lambda _: None,
) -> Measured:
    """Measure the scenes of a part; a scene that fails has a row with the reason.

    The numbers are the same on every machine and in every call. The compiled batch uses all
    ``cores`` by default, LAMMPS runs in ``child`` or a process for this part, and
    ``report_progress`` is called with the number of further scenes done.
    """
    begin = time.perf_counter()
    numbers = np.arange(part.start, part.stop)
    given = design.parameters(numbers)
    parameters = dict(given)
    if design.are_plain:
        similar = natural(given)
        parameters["shock.momentum_ratio"] = similar.momentum_ratio
        parameters["shock.rise_time"] = similar.rise_time
    rows = Rows(numbers, NAMES[type(part.backend)], parameters, peaks, design.columns)
    alone = np.ones(numbers.size, np.bool_)
    if is_batched(design, part.backend):
        assert isinstance(part.backend, Native)
        alone = _batches(given, similar, rows, part.backend, cores)
        report_progress(int(np.sum(~alone)))
    with _runner(part.backend, child) as run:
        for row in np.nonzero(alone)[0].tolist():
            try:
                scene = design.scene(given, row)
                if scene.shock.section == "shock" and not (design.are_plain and scene.pulse):
                    parameters["shock.momentum_ratio"][row] = scene.momentum_ratio
                    if scene.rise_time is not None:
                        parameters["shock.rise_time"][row] = scene.rise_time
                rows.fill(row, run(scene))
            except BackendMissing:
                raise
            except HertzchainError as problem:
                rows.fail(row, problem)
            except MemoryError:
                rows.fail(row, RunFailed("there is not enough memory for this scene"))
            report_progress(1)
    table, all_peaks = rows.table(), rows.peaks()
    table.attrs["hertzchain"] = {
        "wall_time_s": time.perf_counter() - begin,
        "versions": {"hertzchain": version("hertzchain"), **rows.versions},
    }
    return Measured(table, all_peaks)


def _batches(
    given: Mapping[str, NDArray[Any]],
    similar: Natural,
    rows: Rows,
    native: Native,
    cores: int | None,
) -> NDArray[np.bool_]:
    """Measure scenes in the compiled batch, by profile and length; return those left, (scenes,)."""
    from hertzchain.engines.native import backend
    from hertzchain.engines.native.batch import similar_peak_forces

    rtol = RTOL if native.rtol is None else native.rtol
    profile, granules = given["shock.profile"], given["chain.granules"]
    fit = similar.is_moderate & (similar.duration * granules < _LONG)
    alike = [
        np.nonzero((profile == one) & (granules == count) & fit)[0]
        for one in np.unique(profile)
        for count in np.unique(granules[(profile == one) & fit])
    ]
    cores = cores or usable_cores()
    # Many small batches keep all cores busy side by side, a few large ones each by itself.
    at_once = cores if len(alike) >= 2 * cores else 1

    def batch(some: NDArray[np.intp]) -> Batch | None:
        ratio, n = similar.momentum_ratio[some], given["shock.duration_ratio"][some]
        one, count = profile_named(str(profile[some[0]])), int(granules[some[0]])
        limit = min(native.time_limit * some.size, YEAR)
        try:
            return similar_peak_forces(one, ratio, n, count, rtol, limit, cores // at_once)
        except TooExpensive:  # measured one by one, the failing scene gets the reason
            return None

    left = np.ones(fit.size, np.bool_)
    rows.versions = backend.versions()
    with ThreadPoolExecutor(at_once) as pool:
        found = map(batch, alike) if at_once == 1 else pool.map(batch, alike)
        for some, batched in zip(alike, found, strict=True):
            if batched is not None:
                force, length = given["shock.peak_force"][some], similar.length[some]
                left[some] = rows.add_batch(some, batched, force, length, similar.time[some])
    return left


@contextmanager
def _runner(backend: Backend, child: Child | None) -> Iterator[Callable[[Scene], Result]]:
    """Yield a function that measures one scene; LAMMPS runs in a process that may crash."""
    if isinstance(backend, Native):
        yield replace(backend, peaks_only=True).run
    elif backend.lmp is not None:  # a binary is a separate process anyway
        yield backend.run
    else:
        from hertzchain.engines.lammps.backend import run_in
        from hertzchain.engines.lammps.isolation import Child

        own = Child()
        try:
            yield lambda scene: run_in(child or own, backend, scene)
        finally:
            own.end()


# Similarity of many scenes at once

_PLAIN = 1e200  # numbers between it and its inverse are far from the limits of floating point


@dataclass(frozen=True, eq=False)
class Natural:
    """Similarity of scenes; arrays of shape (scenes,), NaN for pulse tables."""

    length: FloatArray  # natural unit [m]
    time: FloatArray  # natural unit [s]
    momentum_ratio: FloatArray  # LM_ratio, given or from t0
    rise_time: FloatArray  # t0 [s]
    duration: FloatArray  # until every contact has peaked [natural units]
    is_moderate: NDArray[np.bool_]  # derived numbers are far from the limits of floats


def natural(given: Mapping[str, NDArray[Any]]) -> Natural:
    """Return the natural units of scenes from the parameters that ``Design.parameters`` returns."""
    radius, force = given["chain.radius"], given["shock.peak_force"]
    ratio, rise = given["shock.momentum_ratio"], given["shock.rise_time"]
    n = given["shock.duration_ratio"]
    with np.errstate(all="ignore"):
        stiffness = hertz.stiffness_of_equals(
            radius, given["chain.young_modulus"], given["chain.poisson_ratio"]
        )
        mass = granule_mass(radius, given["chain.density"])
        length, time = length_and_time(stiffness, mass, force)
        unit = 2 * MOMENTUM_IN_NATURAL_UNITS * time / n  # the rise time at LM_ratio 1
        by_ratio = np.isnan(rise)
        ratio, rise = np.where(by_ratio, ratio, rise / unit), np.where(by_ratio, ratio * unit, rise)
        duration = n * rise / time + watched_time(given["chain.granules"], ratio)
        derived = (radius**3, stiffness, mass, force, length, time, time**2, mass * length, ratio)
        is_moderate = np.isfinite(duration)
        for values in (*derived, rise, length / time, force * time, force * length):
            is_moderate &= (values > 1 / _PLAIN) & (values < _PLAIN)
    return Natural(length, time, ratio, rise, duration, is_moderate)
