"""hertzchain judge: results of any code against the reference."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hertzchain.cli import options, output
from hertzchain.cli.verdicts import Shown
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
            " tables, LAMMPS logs and dumps (all files of one dump), which may be gzipped.",
        ),
    ],
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT=NAME",
            help="Which columns are what; repeatable. WHAT: contact, peak_force, time, step,"
            " contact_force, net_force, position, velocity, id. NAME may have * for"
            " numbers and a unit: 'contact_force=F* [kN]'.",
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
    time_limit: options.TimeLimit = "1 h",
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
) -> None:
    """Judge peaks of any code, contact by contact, with the likely cause of differences."""
    from hertzchain.report.judgement import of_judgement
    from hertzchain.verdict.results import judging

    shown = Shown(scene, results, as_json, plot, report, junit, size=size)
    columns = options.by_name("--column", column or [], "peak_force=F")
    step, limit = options.to_seconds("--dt", dt), options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    with output.progress() as report_progress, output.compiling(report_progress):
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
    shown.end(of_judgement(judgement))
