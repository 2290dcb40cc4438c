"""hertzchain run: one backend simulates a scene."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hertzchain.cli import options
from hertzchain.cli.output import (
    OUT_OF_TOLERANCE,
    compiling,
    progress,
    say,
    write_file,
)
from hertzchain.cli.shown import Shown
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError, require
from hertzchain.limits import RTOL
from hertzchain.scene.gauge import NO_GAUGE

if TYPE_CHECKING:
    from hertzchain.observables.result import Result

_METHODS = ("velocity-verlet", "rk4", "srkn-11b", "reference", "scipy")
MethodName = StrEnum("MethodName", {name.upper(): name for name in _METHODS})  # type: ignore[misc]
"""The native methods."""

_TRACE_TIMES = 500  # times of traces without --record, as many as in pictures of force over time

Wanted = StrEnum("Wanted", {"FIRST": "first", "ALL": "all"})
"""The forces for which the wanted accuracy holds."""


def run(
    scene: options.SceneFile,
    backend: options.Backend = typer.Option(options.NATIVE, help="Backend that simulates."),
    rtol: float | None = typer.Option(
        None, help="Wanted relative accuracy of the peaks; chooses method and step. Default: 1e-6."
    ),
    method: MethodName | None = typer.Option(
        None, help="Instead of --rtol: a native method. The others have velocity-verlet."
    ),
    dt: options.LargestStep = None,
    wanted: Wanted | None = typer.Option(
        None,
        help="Forces for which --rtol holds: the first pulse of each contact, or all peaks, those"
        " of reflected waves included. Default: first with a striker, a wall, unlike granules or"
        " gauges.",
    ),
    isolate: options.Isolate = False,
    lmp: options.LammpsBinary = None,
    ranks: options.Ranks = None,
    time_limit: options.TimeLimit = "1 h",
    output: Path | None = typer.Option(
        None,
        "-o",
        "--output",
        help="Write the peaks of all contacts (.csv, .parquet) or the whole result (.json);"
        " with --record the motion (.csv, .parquet).",
    ),
    record: int | None = typer.Option(
        None,
        min=2,
        metavar="N",
        help="Record the motion at N times, equally spaced, for -o (displacement, velocity and"
        " contact force of each granule), --plot, --report and --traces.",
    ),
    plot: Path | None = typer.Option(
        None,
        metavar="FILE",
        help="Draw peaks, forces over time, and a map of both (png, pdf, svg).",
    ),
    traces: Path | None = typer.Option(
        None,
        metavar="FILE",
        help="Write the force of each [[gauge]] over time, without static forces: time_s,"
        " gauge_16_N, contact_10_N, wall_N, near_wall_N (.csv, .parquet), at the times of"
        " --record, else at 500.",
    ),
    size: options.Size = None,
    report: Path | None = typer.Option(
        None, metavar="FILE", help="Write a page (html): plots, tables, all numbers."
    ),
    uncertainty: int | None = typer.Option(None, hidden=True),
    every: options.EveryContact = False,
    as_json: options.AsJson = False,
) -> None:
    """Simulate a scene: peaks, p, F_SW, speed, pressure and error."""
    if uncertainty is not None:
        raise HertzchainError(
            f"--uncertainty {uncertainty} is a command of its own: hertzchain spread {scene} -n"
            f" {uncertainty}"
        )
    from hertzchain.engines.native.duration import with_end
    from hertzchain.report.run import of_result
    from hertzchain.report.waterfall import frame_times, plot_times

    is_recorded = any(path is not None for path in (output, plot, report, traces))
    options.refuse_without_need(is_recorded, record=record is not None)
    of_output = "result" if record is None else "motion"
    files = {of_output: output, "traces": traces}
    shown = Shown(scene, (), as_json, plot, report, every=every, size=size, others=files)
    loaded = options.load_scene(scene)
    require(traces is None or bool(loaded.gauges), "gauge", None, NO_GAUGE)
    step = options.to_seconds("--dt", dt)
    limit = options.to_time_limit(time_limit)
    options.refuse_without_need(backend == "lammps", isolate=isolate, lmp=lmp, ranks=ranks)
    parameters = _parameters(backend, method, step, rtol)
    if wanted is not None:
        parameters["wanted"] = wanted.value
    if backend == "lammps":
        parameters |= options.lammps_options(isolate, lmp, ranks)
    with progress() as report_progress, compiling(report_progress, backend == "native"):
        report_progress(f"{backend}: running")
        loaded, times = with_end(loaded, time_limit=limit), None
        if record is not None or traces is not None:
            times = frame_times(loaded, record or _TRACE_TIMES)
        elif plot is not None or report is not None:
            times = plot_times(loaded)
        if backend == "native":
            parameters["peaks_only"] = times is None and method != "scipy"
        result = ENGINES[backend].make(time_limit=limit, **parameters).run(loaded, times)
    document = of_result(result)
    shown.print(document, f"in {output}" if output and record is None else None)
    _write(result, output, traces, is_motion=record is not None)
    shown.write(document)
    asked = (RTOL if method is None and step is None else None) if rtol is None else rtol
    known = result.wanted_error
    if asked is not None and known > asked:
        why = (
            f"{ENGINES[backend].label} cannot reach this accuracy in practical time;"
            " --backend native does"
            if backend != "native"
            else "native cannot reach this accuracy with damped contacts"
            if loaded.contact is not None
            else "repeated collisions amplify rounding errors"
        )
        reached = f"wanted {asked:g}, reached {known:.1g}"
        say(f"{reached}: {why}")
        raise typer.Exit(OUT_OF_TOLERANCE)


def _write(result: Result, output: Path | None, traces: Path | None, is_motion: bool) -> None:
    """Write the tables of a run: its peaks or its motion, and the traces of its gauges."""
    from hertzchain.report.tables import motion_frame, write_frame, write_result

    if is_motion:
        write_file("Motion", output, lambda path: write_frame(motion_frame(result), path))
    else:
        what = "Result" if output is not None and output.suffix.lower() == ".json" else "Peaks"
        write_file(what, output, lambda path: write_result(result, path))
    write_file("Traces", traces, lambda path: write_frame(result.to_traces(), path))


def _parameters(
    backend: str, method: MethodName | None, dt: float | None, rtol: float | None
) -> dict[str, Any]:
    """Return the numerical parameters of an engine."""
    if backend == "native":
        return {"method": None if method is None else method.value, "dt": dt, "rtol": rtol}
    if method not in (None, MethodName("velocity-verlet")):
        label = ENGINES[backend].label
        raise HertzchainError(
            f"--method {method}: {label} has only velocity-verlet; leave the option out"
        )
    options.refuse_step_and_accuracy(rtol, dt)
    return {"dt": dt, "rtol": RTOL if rtol is None else rtol}
