"""hertzchain judge: results of any code against the reference."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hertzchain.cli import options, output
from hertzchain.cli.verdicts import Shown
from hertzchain.errors import require
from hertzchain.limits import TOLERANCE

Units = StrEnum("Units", {name: name for name in ("si", "cgs", "micro", "nano", "lj")})  # type: ignore[misc]
"""LAMMPS's styles of units."""

SI = Units("si")


def judge(
    scene: options.SceneFile,
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="CSV with the columns contact, peak_force_N, or samples of forces or positions:"
            " tables, LAMMPS logs and dumps (all files of one dump), which may be gzipped; or"
            " measured traces: time_s, gauge_16_N, contact_10_N, wall_N, or any with --column.",
        ),
    ],
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT=NAME",
            help="Which columns are what; repeatable. WHAT: contact, peak_force, time, step,"
            " contact_force, net_force, position, velocity, id. NAME may have * for"
            " numbers and a unit: 'contact_force=F* [kN]'. Of traces: time, gauge_16,"
            " contact_10, wall, as in 'gauge_16=CH1 [25 N]'.",
        ),
    ] = None,
    units: Annotated[
        Units, typer.Option(help="Units of columns without one of their own, by LAMMPS's name.")
    ] = SI,
    dt: Annotated[
        str | None,
        typer.Option(help='The step of the code, seconds or with a unit ("20 ns").'),
    ] = None,
    tolerance: options.Tolerance = TOLERANCE,
    no_shift: Annotated[
        bool,
        typer.Option("--no-shift", help="The clock of traces is that of the run: do not shift it."),
    ] = False,
    time_limit: options.TimeLimit = "1 h",
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
) -> None:
    """Judge peaks of any code, with the likely cause of differences, or measured forces."""
    from hertzchain.report.cards import document_of
    from hertzchain.uncertainty.document import of_validation
    from hertzchain.uncertainty.validation import Validation, validate
    from hertzchain.verdict.results import judging
    from hertzchain.verdict.traces.judging import judge_traces
    from hertzchain.verdict.traces.traces import is_traces, names_in

    shown = Shown(scene, results, as_json, plot, report, junit, size=size)
    columns = options.by_name("--column", column or [], "peak_force=F")
    step, limit = options.to_seconds("--dt", dt), options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    of_traces = len(results) == 1 and is_traces(names_in(results[0]), loaded, columns)
    options.refuse_without_need(of_traces, no_shift=no_shift)
    with output.progress() as report_progress, output.compiling(report_progress):
        if of_traces:
            allowed = "are in the header of a trace, or named by --column 'gauge_16=CH1 [25 N]'"
            require(units is SI and step is None, "units and dt", None, allowed)
            judge_them = validate if loaded.uncertain else judge_traces
            traces = judge_them(
                loaded,
                results[0],
                columns=columns,
                tolerance=tolerance,
                shift=not no_shift,
                time_limit=limit,
                progress=report_progress,
            )
            shown.end(
                of_validation(traces) if isinstance(traces, Validation) else document_of(traces)
            )
        judgement = judging.judge(
            loaded,
            results,
            columns=columns,
            units=units.value,
            tolerance=tolerance,
            dt=step,
            time_limit=limit,
            progress=report_progress,
        )
    shown.end(document_of(judgement))
