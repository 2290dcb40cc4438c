"""hertzchain init, run, compare, predict, timestep and tradeoff: a scene and its simulations."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hertzchain.cli import options
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, UNUSABLE, Answer, Written, working
from hertzchain.engines.registry import ENGINES, compared_by_default
from hertzchain.errors import HertzchainError, OutputError, require
from hertzchain.files import check_outputs
from hertzchain.limits import RTOL
from hertzchain.scene.starters import NAMES, files_of, title_of, write_starter

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene


Starter = StrEnum("Starter", {name.upper(): name for name in NAMES})  # type: ignore[misc]
"""The scenes to start from, as choices of an option."""

PULSE = Starter("pulse")

_METHODS = ("velocity-verlet", "rk4", "srkn-11b", "reference", "scipy")
MethodName = StrEnum("MethodName", {name.upper(): name for name in _METHODS})  # type: ignore[misc]
"""The native methods."""

Wanted = StrEnum("Wanted", {"FIRST": "first", "ALL": "all"})
"""The forces for which the wanted accuracy holds."""


def init(path: Path = Path("scene.toml"), *, kind: Starter = PULSE) -> None:
    """Write a commented scene file to start from.

    The command also says what to do next. "pulse-table" also writes a table next to it, to be
    replaced with a measured pulse.

    Options
    -------
    path FILE: The scene file to write (TOML).
    kind: Kind of the scene.
    """
    check_outputs([], files_of(kind.value, path))
    if there := [file for file in files_of(kind.value, path) if file.exists()]:
        raise OutputError(f"{there[0]}: exists; name another file, or delete it")
    written = write_starter(kind.value, path)
    typer.echo(f"{' and '.join(map(str, written))}: {title_of(kind.value)}")
    typer.echo(f"Change it in an editor, then: hertzchain compare {shlex.quote(str(path))}")


@dataclass(frozen=True)
class AccuracyOptions:
    """How accurate a run is, and how long it may take.

    Options
    -------
    rtol: Wanted relative accuracy of the peaks; chooses method and step. Default: 1e-6.
    method: Instead of --rtol: a native method. The others have velocity-verlet.
    wanted: Forces for which --rtol holds: the first pulse of each contact, or all peaks, those of
        reflected waves included. Default: first with a striker, a wall, unlike granules or gauges.
    """

    rtol: float | None = None
    method: MethodName | None = None
    dt: str | None = None
    wanted: Wanted | None = None
    time_limit: str = "1 h"

    def parameters(self, backend: str) -> dict[str, Any]:
        """Return the numerical parameters of an engine."""
        parameters: dict[str, Any] = {
            "dt": options.to_seconds("--dt", self.dt),
            "time_limit": options.to_time_limit(self.time_limit),
        }
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

    def missed(self, backend: str, result: Result) -> list[str]:
        """Return a sentence if a run is less accurate than was asked for."""
        is_chosen = self.method is None and self.dt is None
        asked = (RTOL if is_chosen else None) if self.rtol is None else self.rtol
        error = result.wanted_error
        if asked is None or not error > asked:
            return []
        why = (
            f"{ENGINES[backend].label} cannot reach this accuracy in practical time;"
            " --backend native does"
            if backend != "native"
            else "native cannot reach this accuracy with damped contacts"
            if result.scene.contact is not None
            else "repeated collisions amplify rounding errors"
        )
        return [f"wanted {asked:g}, reached {error:.1g}: {why}"]


@dataclass(frozen=True)
class TableOptions:
    """The tables that a run writes.

    Options
    -------
    output: Write the peaks of all contacts (.csv, .parquet) or the whole result (.json); with
        --record the motion (.csv, .parquet).
    record N: Record the motion at N times, equally spaced, for -o (displacement, velocity and
        contact force of each granule), --plot, --report and --traces.
    traces FILE: Write the force of each [[gauge]] over time, without static forces: time_s,
        gauge_16_N, contact_10_N, wall_N, near_wall_N (.csv, .parquet), at the times of --record,
        else at 500.
    pulses: Find all pulses of each contact and gauge, incident and reflected, by three further
        runs. With -o pulses.csv their table is written.
    """

    output: Path | None = None
    record: int | None = None
    traces: Path | None = None
    pulses: bool = False

    def check(self, scene: Scene, is_drawn: bool) -> None:
        """Refuse tables that the run will not have."""
        from hertzchain.report.files import check_format
        from hertzchain.scene.terms import NO_GAUGE

        is_recorded = is_drawn or self.output is not None or self.traces is not None
        options.refuse_without_need(is_recorded, record=self.record is not None)
        allowed = "must be at least 2"
        require(self.record is None or self.record >= 2, "--record", self.record, allowed)
        check_format(self.output, "motion" if self.record else "result")
        require(self.traces is None or bool(scene.gauges), "gauge", None, NO_GAUGE)

    def times(self, scene: Scene, is_drawn: bool) -> FloatArray | None:
        """Return the times [s] that are recorded, if any."""
        from hertzchain.report.files import frame_times, plot_times

        if self.record is not None or self.traces is not None:
            # Times of traces without --record, as many as in pictures of force over time
            return frame_times(scene, self.record or 500)
        return plot_times(scene) if is_drawn else None

    def files(self, result: Result) -> list[Written]:
        """Return the tables: peaks, pulses or the motion, and the traces of gauges."""
        from hertzchain.report.files import motion_frame, write_frame, write_result

        def write(path: Path) -> None:
            if self.record is not None:
                write_frame(motion_frame(result), path)
            else:
                write_result(result, path, self.pulses)

        is_whole = self.output is not None and self.output.suffix.lower() == ".json"
        what = "Result" if is_whole else "Pulses" if self.pulses else "Peaks"
        return [
            Written("Motion" if self.record else what, self.output, write),
            Written("Traces", self.traces, lambda path: write_frame(result.to_traces(), path)),
        ]


def run(
    scene: Path,
    *,
    backend: options.Backend = options.NATIVE,
    accuracy: AccuracyOptions,
    lammps: options.LammpsOptions,
    tables: TableOptions,
    shown: options.DocumentOptions,
    every: bool = False,
) -> Answer:
    """Simulate a scene: peaks, p, F_SW, speed, pressure and error.

    Options
    -------
    backend: Backend that simulates.
    """
    from hertzchain.engines.native.backend import with_end
    from hertzchain.report.contents import of_result

    loaded = options.load_scene(scene)
    is_drawn = shown.plot is not None or shown.report is not None
    tables.check(loaded, is_drawn)
    parameters = lammps.parameters(backend == "lammps") | accuracy.parameters(backend)
    with working(backend == "native") as report_progress:
        report_progress(f"{backend}: running")
        loaded = with_end(loaded, time_limit=parameters["time_limit"])
        times = tables.times(loaded, is_drawn)
        if backend == "native":
            parameters["peaks_only"] = times is None and accuracy.method != "scipy"
        result = ENGINES[backend].make(**parameters).run(loaded, times)
        if tables.pulses:
            report_progress(f"{backend}: recording all pulses")
            _ = result.trains
    is_table = tables.output is not None and not tables.record
    rest = f"in {tables.output}" if is_table else None
    answer = shown.answer(of_result(result, tables.pulses), scene, rest=rest, every=every)
    missed = accuracy.missed(backend, result)
    status = OUT_OF_TOLERANCE if missed else DONE
    files = [*tables.files(result), *answer.files]
    return replace(answer, files=files, remarks=missed, status=status)


def compare(
    scene: Path,
    *,
    backend: list[options.Backend] | None = None,
    lammps: options.LammpsOptions,
    rtol: float | None = None,
    as_written: bool = False,
    time_limit: str = "1 h",
    every: bool = False,
    shown: options.VerdictOptions,
) -> Answer:
    """Compare native, LAMMPS and the formulas, with a verdict.

    Options
    -------
    backend: Backend to compare with the reference; repeatable. Default: native, lammps.
    rtol: Wanted relative accuracy of the codes that are compared. Default: 1e-6, or 1e-4 where
        dashpots close at a speed.
    as_written: Compare native with Eq. 1 as written, by SciPy, also where this takes more than a
        second or two.
    """
    from hertzchain.engines.external.accuracy import usual_accuracy
    from hertzchain.engines.native.backend import with_end
    from hertzchain.report.contents import document_of
    from hertzchain.report.files import plot_times
    from hertzchain.verdict import comparison

    names = dict.fromkeys(["native", *map(str, backend or compared_by_default())])
    special = {
        "native": {"method": "reference"},
        "lammps": lammps.parameters("lammps" in names),
    }
    loaded = options.load_scene(scene)
    limit = options.to_time_limit(time_limit)
    wanted = {"rtol": usual_accuracy(loaded) if rtol is None else rtol}
    engines = [
        ENGINES[name].make(
            time_limit=limit, **({} if name == "native" else wanted), **special.get(name, {})
        )
        for name in names
    ]
    with working() as report_progress:
        loaded = with_end(loaded, time_limit=limit)
        record = plot_times(loaded) if shown.report or shown.plot else None
        compared = comparison.compare(
            loaded, engines, record=record, as_written=as_written, progress=report_progress
        )
    return shown.answer(document_of(compared), scene, every=every)


def predict(scene: Path) -> Answer:
    """Predict peaks, p and F_SW without a simulation.

    They come from the formulas, a map of simulated peaks, and the exact solitary wave.
    """
    from hertzchain import theory
    from hertzchain.report.console import print_prediction

    prediction = theory.predict(options.load_scene(scene))
    return Answer(prediction.to_dict, lambda console: print_prediction(console, prediction))


def timestep(scene: Path, *, rtol: float = 1e-3) -> None:
    """Find the longest time step of LAMMPS for a wanted accuracy.

    The step holds for any code that uses velocity Verlet.

    Options
    -------
    rtol: Wanted relative error of the peaks.
    """
    from hertzchain.known.answer import deck_step

    loaded = options.load_scene(scene)
    with working() as report_progress:
        report_progress("trying steps")
        step = deck_step(loaded, rtol=rtol) * loaded.units.time
    typer.echo(
        f"timestep {step:.3g} s: peaks right to {rtol:g} in {loaded.end_time / step:.0f} steps"
    )


def tradeoff(scene: Path, *, picture: options.PictureOptions) -> Answer:
    """Measure error against cost of every method on a scene.

    This takes half a minute for 60 granules.
    """
    from hertzchain.report import figures
    from hertzchain.report.console import print_tradeoff
    from hertzchain.verdict.tradeoff import tradeoff as measure

    loaded = options.load_scene(scene)
    with working() as report_progress:
        measured = measure(loaded, progress=report_progress)
    return Answer(
        measured.to_dict,
        lambda console: print_tradeoff(console, measured),
        [picture.picture(lambda size: figures.plot_tradeoff(measured, size))],
        measured.remarks,
        UNUSABLE if measured.missing else DONE,
    )
