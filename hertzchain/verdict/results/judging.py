"""The judgement of results in any of the forms that are read: converted to peaks, judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from numpy.typing import ArrayLike

from hertzchain.errors import POSITIVE, is_positive, require
from hertzchain.limits import TIME_LIMIT, TOLERANCE
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.showing import ShowProgress, telling
from hertzchain.verdict.judgement import Judgement, judged
from hertzchain.verdict.results.reading import read

Results = Annotated[Path | str | Sequence[Path | str] | Mapping[int, float] | ArrayLike, read]
"""What can be judged; pandas tables are array-like, too."""


def judge(
    scene: SceneLike,
    results: Results,
    *,
    units: str = "si",
    tolerance: float = TOLERANCE,
    dt: float | None = None,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Judgement:
    """Judge results of any code by the reference, and search for the cause of differences.

    Parameters
    ----------
    scene
        What was computed, or the path of its file.
    results
        Peak forces [N] of contacts by the paper's numbers, 2 ... N, and N + 1 at a wall: a mapping
        from contacts to forces, or an array of shape (contacts,) with NaN for missing peaks.

        Or a pandas table, or a CSV file, with the columns contact and peak_force_N.

        Or a text dump of all granules by LAMMPS with id, x and fx, or a list of files that together
        are one: peaks are found between its frames. Files may be gzipped.
    units
        ``si``, ``cgs``, ``micro``, ``nano`` (LAMMPS's styles), of a dump.
    tolerance
        Largest relative difference that passes; between 0 and 1.
    dt
        Step of the code [s], if known; it turns numbers of steps into times. The error of velocity
        Verlet at this step is stated, except for damped contacts.
    time_limit
        Time limit of the reference [s].
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For anything but a scene, for results that cannot be used, impossible peaks, tolerances or
        steps, and for a tolerance within the error of the reference.
    RunFailed
        If the reference cannot be computed, or velocity Verlet is unstable with such a step.
    """
    scene = to_scene(scene)
    require(dt is None or is_positive(dt), "dt", dt, f"{POSITIVE} [s]")
    with telling(progress) as report_progress:
        report_progress("reading results")
        given = read(scene, results, units, dt)
        sampling = given.error if given.how else None
        found = judged(
            scene, given.peak_force, tolerance, dt, sampling, time_limit, report_progress
        )
    if not given.how:
        return found
    remarks = [given.how]
    if found.sampled_too_rarely:
        remarks.append(
            f"{found.sampled_too_rarely} contacts are not judged, as samples so far apart, or"
            f" numbers of so few digits, may be off by more than the tolerance of {tolerance:.1e}:"
            " write samples more often, with dump_modify format float %.15g"
        )
    return replace(found, remarks=(*remarks, *found.remarks))
