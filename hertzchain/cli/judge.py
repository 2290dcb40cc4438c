"""hertzchain judge: results of any code against the reference."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Any

import typer

from hertzchain.cli import options, output
from hertzchain.cli.shown import Shown
from hertzchain.errors import require
from hertzchain.limits import TOLERANCE

Units = StrEnum("Units", {name: name for name in ("si", "cgs", "micro", "nano")})  # type: ignore[misc]
"""LAMMPS's styles of units."""

SI = Units("si")


def judge(
    scene: options.SceneFile,
    results: list[Path] = typer.Argument(
        ...,
        metavar="FILE",
        help="CSV with the columns contact, peak_force_N; or a LAMMPS dump of all granules with id,"
        " x, fx (all files of one dump); or measured traces: time_s, gauge_16_N, contact_10_N,"
        " wall_N, near_wall_N, or any with --column. Peaks and dumps may be gzipped.",
    ),
    column: list[str] | None = typer.Option(
        None,
        metavar="WHAT=NAME",
        help="Which columns of traces are what; repeatable. WHAT: time, gauge_16, contact_10, wall,"
        " as in 'gauge_16=CH1 [25 N]'.",
    ),
    units: Units = typer.Option(SI, help="Units of a dump, by LAMMPS's name."),
    dt: str | None = typer.Option(
        None, metavar="TIME", help='The step of the code, seconds or with a unit ("20 ns").'
    ),
    tolerance: float | None = typer.Option(
        None,
        help="Largest relative difference that passes, 0.001 unless given. Of a scene with"
        " [uncertainty]: one that must be detected, 0.1 unless given.",
    ),
    no_shift: bool = typer.Option(
        False, "--no-shift", help="The clock of traces is that of the run: do not shift it."
    ),
    time_limit: options.TimeLimit = "1 h",
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
) -> None:
    """Judge the peaks of any code, or measured forces.

    Where peaks differ, the likely cause is named.
    """
    from hertzchain.report.cards import document_of
    from hertzchain.uncertainty.document import of_validation
    from hertzchain.uncertainty.validation import SEEN, validate
    from hertzchain.verdict.results import judging
    from hertzchain.verdict.traces.judging import judge_traces
    from hertzchain.verdict.traces.traces import is_traces, names_in

    shown = Shown(scene, results, as_json, plot, report, junit, size=size)
    columns = options.by_name("--column", column or [], "gauge_16=CH1")
    step, limit = options.to_seconds("--dt", dt), options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    of_traces = len(results) == 1 and is_traces(names_in(results[0]), columns)
    options.refuse_without_need(of_traces, no_shift=no_shift, column=bool(columns))
    with output.progress() as report_progress, output.compiling(report_progress):
        if of_traces:
            allowed = "are in the header of a trace, or named by --column 'gauge_16=CH1 [25 N]'"
            require(units is SI and step is None, "units and dt", None, allowed)
            how: dict[str, Any] = {
                "columns": columns,
                "shift": not no_shift,
                "time_limit": limit,
                "progress": report_progress,
            }
            if loaded.uncertain:
                seen = SEEN if tolerance is None else tolerance
                shown.end(of_validation(validate(loaded, results[0], tolerance=seen, **how)))
            within = TOLERANCE if tolerance is None else tolerance
            shown.end(document_of(judge_traces(loaded, results[0], tolerance=within, **how)))
        judgement = judging.judge(
            loaded,
            results,
            units=units.value,
            tolerance=TOLERANCE if tolerance is None else tolerance,
            dt=step,
            time_limit=limit,
            progress=report_progress,
        )
    shown.end(document_of(judgement))
