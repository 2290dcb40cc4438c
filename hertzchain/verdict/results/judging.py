"""The judgement of results as people have them: read, turned into peaks, judged."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.errors import POSITIVE, is_positive, require
from hertzchain.limits import TIME_LIMIT
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.showing import ShowProgress, telling
from hertzchain.verdict.judgement import TOLERANCE, Judgement, judge
from hertzchain.verdict.results.reading import read

if TYPE_CHECKING:
    import pandas


def judge_peaks(
    scene: SceneLike,
    results: Path | str | pandas.DataFrame,
    *,
    columns: Mapping[str, str] | None = None,
    units: str = "si",
    tolerance: float = TOLERANCE,
    dt: float | None = None,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Judgement:
    """Judge the results of another code: a table of peaks, or samples of its run.

    Parameters
    ----------
    scene
        What was computed, or the path of its file.
    results
        A pandas table, or a file: CSV or columns of numbers, a log of LAMMPS, the output of ``fix
        ave/time`` or ``fix print``, a text dump of granules or of pairs, or a trajectory that ASE
        reads (``.traj``, ``.extxyz``, ``.xyz``). Tables have peaks (contact, peak_force), or
        samples over time of contact_force, net_force, position or velocity, a column for each
        contact or granule.
    columns
        Which columns are what: names by ``contact``, ``peak_force``, ``time``, ``step``,
        ``contact_force``, ``net_force``, ``position``, ``velocity``, ``id``, ``id1``, ``id2``.
        ``*`` stands for the numbers of several columns; a unit may follow: ``"F* [kN]"``. What is
        not named is known by its usual names.
    units
        ``si``, ``cgs``, ``micro``, ``nano`` (LAMMPS's styles), of columns without a unit; with
        ``lj`` each column needs one.
    tolerance, time_limit, progress
        As for ``judge``.
    dt
        The step it was computed with [s], if it is known; it turns numbers of steps into times.

    Raises
    ------
    SceneError
        For a file or table that cannot be used: one sentence says why.
    RunFailed
        As ``judge``.
    """
    scene = to_scene(scene)
    require(dt is None or is_positive(dt), "dt", dt, f"{POSITIVE} [s]")
    source = Path(results) if isinstance(results, str | os.PathLike) else results
    with telling(progress) as report_progress:
        report_progress("reading results")
        given = read(scene, source, columns or {}, units, dt)
        found = judge(
            scene,
            given.peak_force,
            tolerance=tolerance,
            dt=dt,
            sampling=given.sampling,
            time_limit=time_limit,
            progress=report_progress,
        )
    if given.sampling is None:
        return found
    remarks = [given.remark]
    rare = given.sampling > tolerance
    rare &= np.isfinite(given.peak_force) & (found.reference.peak_force > 0)
    if rare.any():
        remarks.append(
            f"{np.count_nonzero(rare)} contacts are not judged, as samples so far apart may be off"
            f" by more than the tolerance of {tolerance:.1e}: write samples more often"
        )
    return replace(found, remarks=(*remarks, *found.remarks))
