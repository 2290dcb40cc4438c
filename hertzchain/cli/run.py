"""hertzchain run and compare: simulations of a scene."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hertzchain.cli import options, output
from hertzchain.cli.output import OUT_OF_TOLERANCE, compiling, progress, say, write_file
from hertzchain.cli.shown import Shown
from hertzchain.engines.registry import ENGINES, compared_by_default
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
    pulses: bool = typer.Option(
        False,
        "--pulses",
        help="Find all pulses of each contact and gauge, incident and reflected, by three further"
        " runs. With -o pulses.csv their table is written.",
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
        if pulses:
            report_progress(f"{backend}: recording all pulses")
            _ = result.trains
    document = of_result(result, pulses)
    shown.print(document, f"in {output}" if output and record is None else None)
    _write(result, output, traces, is_motion=record is not None, pulses=pulses)
    shown.write(document)
    asked = (RTOL if method is None and step is None else None) if rtol is None else rtol
    error = result.wanted_error
    if asked is not None and error > asked:
        why = (
            f"{ENGINES[backend].label} cannot reach this accuracy in practical time;"
            " --backend native does"
            if backend != "native"
            else "native cannot reach this accuracy with damped contacts"
            if loaded.contact is not None
            else "repeated collisions amplify rounding errors"
        )
        say(f"wanted {asked:g}, reached {error:.1g}: {why}")
        raise typer.Exit(OUT_OF_TOLERANCE)


def _write(
    result: Result, output: Path | None, traces: Path | None, is_motion: bool, pulses: bool
) -> None:
    """Write the tables of a run: its peaks or its motion, and the traces of its gauges."""
    from hertzchain.report.files import motion_frame, write_frame, write_result

    if is_motion:
        write_file("Motion", output, lambda path: write_frame(motion_frame(result), path))
    else:
        of_table = "Pulses" if pulses else "Peaks"
        is_whole = output is not None and output.suffix.lower() == ".json"
        what = "Result" if is_whole else of_table
        write_file(what, output, lambda path: write_result(result, path, pulses))
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


def compare(
    scene: options.SceneFile,
    backend: list[options.Backend] | None = typer.Option(
        None, help="Backend to compare with the reference; repeatable. Default: native, lammps."
    ),
    isolate: options.Isolate = False,
    lmp: options.LammpsBinary = None,
    ranks: options.Ranks = None,
    rtol: float | None = typer.Option(
        None,
        help="Wanted relative accuracy of the codes that are compared. Default: 1e-6, or 1e-4"
        " where dashpots close at a speed.",
    ),
    as_written: bool = typer.Option(
        False,
        "--as-written",
        help="Compare native with Eq. 1 as written, by SciPy, also where this takes"
        " more than a second or two.",
    ),
    time_limit: options.TimeLimit = "1 h",
    every: options.EveryContact = False,
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
) -> None:
    """Compare native, LAMMPS and the formulas, with a verdict."""
    from hertzchain.engines.external.step_error import usual_accuracy
    from hertzchain.engines.native.duration import with_end
    from hertzchain.report.verdicts import of_comparison
    from hertzchain.report.waterfall import plot_times
    from hertzchain.verdict import comparison

    names = dict.fromkeys(["native", *map(str, backend or compared_by_default())])
    shown = Shown(scene, (), as_json, plot, report, junit, every, size)
    with_lammps = "lammps" in names
    options.refuse_without_need(with_lammps, isolate=isolate, lmp=lmp, ranks=ranks)
    loaded = options.load_scene(scene)
    limit = options.to_time_limit(time_limit)
    wanted = usual_accuracy(loaded) if rtol is None else rtol
    parameters: dict[str, dict[str, Any]] = {name: {"rtol": wanted} for name in names}
    parameters["native"] = {"method": "reference"}
    if with_lammps:
        parameters["lammps"] |= options.lammps_options(isolate, lmp, ranks)
    engines = [ENGINES[name].make(time_limit=limit, **parameters[name]) for name in names]
    with output.progress() as report_progress, output.compiling(report_progress):
        loaded = with_end(loaded, time_limit=limit)
        record = plot_times(loaded) if report or plot else None
        compared = comparison.compare(
            loaded, engines, record=record, as_written=as_written, progress=report_progress
        )
    shown.end(of_comparison(compared))
