"""hertzchain run and compare: simulations of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hertzchain.cli import options, output
from hertzchain.cli.output import OUT_OF_TOLERANCE, compiling, progress, say, write_file
from hertzchain.cli.shown import Shown
from hertzchain.engines.registry import ENGINES, compared_by_default
from hertzchain.errors import HertzchainError, require
from hertzchain.limits import RTOL

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene


_METHODS = ("velocity-verlet", "rk4", "srkn-11b", "reference", "scipy")
MethodName = StrEnum("MethodName", {name.upper(): name for name in _METHODS})  # type: ignore[misc]
"""The native methods."""


Wanted = StrEnum("Wanted", {"FIRST": "first", "ALL": "all"})
"""The forces for which the wanted accuracy holds."""


@dataclass(frozen=True)
class AccuracyOptions:
    """Options of how accurate a run is, and how long it may take."""

    rtol: Annotated[
        float | None,
        typer.Option(
            help="Wanted relative accuracy of the peaks; chooses method and step. Default: 1e-6."
        ),
    ] = None
    method: Annotated[
        MethodName | None,
        typer.Option(help="Instead of --rtol: a native method. The others have velocity-verlet."),
    ] = None
    dt: options.LargestStep = None
    wanted: Annotated[
        Wanted | None,
        typer.Option(
            help="Forces for which --rtol holds: the first pulse of each contact, or all peaks,"
            " those of reflected waves included. Default: first with a striker, a wall, unlike"
            " granules or gauges.",
        ),
    ] = None
    time_limit: options.TimeLimit = "1 h"

    def parameters(self, backend: str) -> dict[str, Any]:
        """Return the numerical parameters of an engine."""
        parameters: dict[str, Any] = {"dt": options.to_seconds("--dt", self.dt)}
        if self.wanted is not None:
            parameters["wanted"] = self.wanted.value
        if backend == "native":
            method = None if self.method is None else self.method.value
            return parameters | {"method": method, "rtol": self.rtol}
        if self.method not in (None, MethodName("velocity-verlet")):
            label = ENGINES[backend].label
            raise HertzchainError(
                f"--method {self.method}: {label} has only velocity-verlet; leave the option out"
            )
        options.refuse_step_and_accuracy(self.rtol, self.dt)
        return parameters | {"rtol": RTOL if self.rtol is None else self.rtol}

    def warn(self, backend: str, result: Result) -> None:
        """Report, with a status of its own, that a run is less accurate than was asked for."""
        is_chosen = self.method is None and self.dt is None
        asked = (RTOL if is_chosen else None) if self.rtol is None else self.rtol
        error = result.wanted_error
        if asked is None or not error > asked:
            return
        why = (
            f"{ENGINES[backend].label} cannot reach this accuracy in practical time;"
            " --backend native does"
            if backend != "native"
            else "native cannot reach this accuracy with damped contacts"
            if result.scene.contact is not None
            else "repeated collisions amplify rounding errors"
        )
        say(f"wanted {asked:g}, reached {error:.1g}: {why}")
        raise typer.Exit(OUT_OF_TOLERANCE)


@dataclass(frozen=True)
class TableOptions:
    """Options of the tables that a run writes."""

    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write the peaks of all contacts (.csv, .parquet) or the whole result (.json);"
            " with --record the motion (.csv, .parquet).",
        ),
    ] = None
    record: Annotated[
        int | None,
        typer.Option(
            min=2,
            metavar="N",
            help="Record the motion at N times, equally spaced, for -o (displacement, velocity and"
            " contact force of each granule), --plot, --report and --traces.",
        ),
    ] = None
    traces: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write the force of each [[gauge]] over time, without static forces: time_s,"
            " gauge_16_N, contact_10_N, wall_N, near_wall_N (.csv, .parquet), at the times of"
            " --record, else at 500.",
        ),
    ] = None
    pulses: Annotated[
        bool,
        typer.Option(
            "--pulses",
            help="Find all pulses of each contact and gauge, incident and reflected, by three"
            " further runs. With -o pulses.csv their table is written.",
        ),
    ] = False

    @property
    def is_motion(self) -> bool:
        """Whether the motion is written."""
        return self.record is not None

    @property
    def files(self) -> dict[str, Path | None]:
        """Files by the kinds of ``check_format``."""
        return {"motion" if self.is_motion else "result": self.output, "traces": self.traces}

    def times(self, scene: Scene, is_drawn: bool) -> FloatArray | None:
        """Return the times [s] that are recorded, if any."""
        from hertzchain.report.files import frame_times, plot_times

        if self.is_motion or self.traces is not None:
            # Times of traces without --record, as many as in pictures of force over time
            return frame_times(scene, self.record or 500)
        return plot_times(scene) if is_drawn else None

    def write(self, result: Result) -> None:
        """Write the tables: peaks, pulses or the motion, and the traces of gauges."""
        from hertzchain.report.files import motion_frame, write_frame, write_result

        if self.is_motion:
            write_file("Motion", self.output, lambda path: write_frame(motion_frame(result), path))
        else:
            is_whole = self.output is not None and self.output.suffix.lower() == ".json"
            what = "Result" if is_whole else "Pulses" if self.pulses else "Peaks"
            write_file(what, self.output, lambda path: write_result(result, path, self.pulses))
        write_file("Traces", self.traces, lambda path: write_frame(result.to_traces(), path))


def run(
    scene: options.SceneFile,
    *,
    backend: options.Backend = typer.Option(options.NATIVE, help="Backend that simulates."),
    accuracy: AccuracyOptions,
    lammps: options.LammpsOptions,
    tables: TableOptions,
    shown: options.DocumentOptions,
    every: options.EveryContact = False,
    uncertainty: int | None = typer.Option(None, hidden=True),
) -> None:
    """Simulate a scene: peaks, p, F_SW, speed, pressure and error."""
    if uncertainty is not None:
        raise HertzchainError(
            f"--uncertainty {uncertainty} is a command of its own: hertzchain spread {scene} -n"
            f" {uncertainty}"
        )
    from hertzchain.engines.native.duration import with_end
    from hertzchain.report.documents import of_result
    from hertzchain.scene.terms import NO_GAUGE

    is_drawn = shown.plot is not None or shown.report is not None
    is_recorded = is_drawn or any(tables.files.values())
    options.refuse_without_need(is_recorded, record=tables.is_motion)
    outputs = Shown(scene, shown, every=every, others=tables.files)
    loaded = options.load_scene(scene)
    require(tables.traces is None or bool(loaded.gauges), "gauge", None, NO_GAUGE)
    limit = options.to_time_limit(accuracy.time_limit)
    parameters = lammps.parameters(backend == "lammps") | accuracy.parameters(backend)
    with progress() as report_progress, compiling(report_progress, backend == "native"):
        report_progress(f"{backend}: running")
        loaded = with_end(loaded, time_limit=limit)
        times = tables.times(loaded, is_drawn)
        if backend == "native":
            parameters["peaks_only"] = times is None and accuracy.method != "scipy"
        result = ENGINES[backend].make(time_limit=limit, **parameters).run(loaded, times)
        if tables.pulses:
            report_progress(f"{backend}: recording all pulses")
            _ = result.trains
    document = of_result(result, tables.pulses)
    is_table = tables.output is not None and not tables.is_motion
    outputs.print(document, f"in {tables.output}" if is_table else None)
    tables.write(result)
    outputs.write(document)
    accuracy.warn(backend, result)


def compare(
    scene: options.SceneFile,
    *,
    backend: list[options.Backend] | None = typer.Option(
        None, help="Backend to compare with the reference; repeatable. Default: native, lammps."
    ),
    lammps: options.LammpsOptions,
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
    shown: options.VerdictOptions,
) -> None:
    """Compare native, LAMMPS and the formulas, with a verdict."""
    from hertzchain.engines.external.accuracy import usual_accuracy
    from hertzchain.engines.native.duration import with_end
    from hertzchain.report.documents import of_comparison
    from hertzchain.report.files import plot_times
    from hertzchain.verdict import comparison

    names = dict.fromkeys(["native", *map(str, backend or compared_by_default())])
    outputs = Shown(scene, shown, every=every)
    of_lammps = lammps.parameters("lammps" in names)
    loaded = options.load_scene(scene)
    limit = options.to_time_limit(time_limit)
    wanted = usual_accuracy(loaded) if rtol is None else rtol
    parameters: dict[str, dict[str, Any]] = {name: {"rtol": wanted} for name in names}
    parameters["native"] = {"method": "reference"}
    if "lammps" in names:
        parameters["lammps"] |= of_lammps
    engines = [ENGINES[name].make(time_limit=limit, **parameters[name]) for name in names]
    with output.progress() as report_progress, output.compiling(report_progress):
        loaded = with_end(loaded, time_limit=limit)
        record = plot_times(loaded) if shown.report or shown.plot else None
        compared = comparison.compare(
            loaded, engines, record=record, as_written=as_written, progress=report_progress
        )
    outputs.end(of_comparison(compared))
