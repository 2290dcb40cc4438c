"""hertzchain pulse, judge, fit, spectrum and spread: measured forces, and what is uncertain."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from hertzchain.cli import options, output
from hertzchain.cli.options import AsJson, to_seconds
from hertzchain.cli.output import (
    OUT_OF_TOLERANCE,
    check_files,
    compiling,
    progress,
    say,
    show,
    write_file,
)
from hertzchain.cli.shown import Shown
from hertzchain.errors import HertzchainError, require
from hertzchain.limits import TOLERANCE


@dataclass(frozen=True)
class ColumnOptions:
    """Options of how the columns of a recording are read."""

    time: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN", help="Name or number of the column of times. Default: the first."
        ),
    ] = None
    force: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN", help="Name or number of the column of forces. Default: the next."
        ),
    ] = None
    time_unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="Unit of the times. Default: that of the header, or s."),
    ] = None
    scale: Annotated[
        float | None,
        typer.Option(help="N for each unit of the column, such as N per volt; may be negative."),
    ] = None


@dataclass(frozen=True)
class PartOptions:
    """Options of which part of a recording is the pulse."""

    baseline: Annotated[
        float | None,
        typer.Option(
            help="Value of the column without a force, in its unit. Default: its mean before the"
            " pulse.",
        ),
    ] = None
    start: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help='Where the pulse starts in the file, seconds or with a unit ("-20 us"). Default:'
            " where it leaves the noise.",
        ),
    ] = None
    end: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="Where the pulse ends. Default: where it is back in the noise.",
        ),
    ] = None


def pulse(
    recording: Path = typer.Argument(
        ..., metavar="RECORDING", help="Text file of an oscilloscope: columns of time and force."
    ),
    *,
    output: Path | None = typer.Option(
        None, "-o", "--output", metavar="FILE", help="Write the pulse table (CSV) of a scene."
    ),
    column: ColumnOptions,
    part: PartOptions,
    rows: int = typer.Option(80, help="Most rows of the table."),
    picture: options.PictureOptions,
    as_json: AsJson = False,
) -> None:
    """Make a pulse table of a recorded force.

    The table has no baseline, begins and ends with the pulse, and has few rows. The command says
    what was changed, and how well F0 and impulse are known. Comments, header, separator and decimal
    commas are recognised.
    """
    import json

    from hertzchain.files import write_text
    from hertzchain.pulses.pulse import measured_pulse, pulse_of
    from hertzchain.pulses.recording import read_recording
    from hertzchain.report.pulse import plot_pulse, print_pulse

    check_files([recording], [output], plot=picture.plot)
    inches = picture.inches
    ends = to_seconds("--start", part.start), to_seconds("--end", part.end)
    read = read_recording(recording, column.time, column.force, column.time_unit, column.scale)
    with progress() as report_progress:
        report_progress("choosing the fewest rows that keep the pulse")
        measured = measured_pulse(read, pulse_of(read, part.baseline, *ends), rows)
    if output is not None:
        write_text(output, measured.to_text())
    show(as_json, measured.to_dict, lambda console: print_pulse(console, measured))
    for warning in measured.signal.warnings:
        say(warning)
    if output is not None:
        say(
            f"Pulse table written to {output}; a scene next to it takes it under [shock] as"
            f' profile = "table" and file = {json.dumps(output.name, ensure_ascii=False)}',
            "",
        )
    write_file("Plot", picture.plot, lambda path: plot_pulse(measured, inches).write(path))


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
        " wall_N, near_wall_N, or any with --column (also a file for each channel of a record); or"
        " measured pulses: contact or granule, force_N, perhaps time_s and width_s. Peaks and dumps"
        " may be gzipped.",
    ),
    *,
    traces: options.TraceOptions,
    units: Units = typer.Option(SI, help="Units of a dump, by LAMMPS's name."),
    dt: str | None = typer.Option(
        None, metavar="TIME", help='The step of the code, seconds or with a unit ("20 ns").'
    ),
    tolerance: float | None = typer.Option(
        None,
        help="Largest relative difference that passes, 0.001 unless given. Of a scene with"
        " [uncertainty]: one that must be detected, 0.1 unless given.",
    ),
    time_limit: options.TimeLimit = "1 h",
    shown: options.VerdictOptions,
) -> None:
    """Judge the peaks of any code, or measured forces.

    Where peaks differ, the likely cause is named.
    """
    from hertzchain.pulses.recording import read_columns
    from hertzchain.report.documents import document_of
    from hertzchain.uncertainty.validation import SEEN, of_validation, validate
    from hertzchain.verdict.results import is_train, judge_trains
    from hertzchain.verdict.results import judge as judge_peaks
    from hertzchain.verdict.traces import is_traces, judge_traces, names_in

    outputs = Shown(scene, shown, results)
    columns = traces.columns
    step, limit = options.to_seconds("--dt", dt), options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    names = names_in(results[0])
    are_traces = [is_traces(names_in(file), columns) for file in results]
    of_traces = all(are_traces)
    if any(are_traces) and not of_traces:
        other = results[are_traces.index(False)]
        read_columns(other)  # raises where it cannot be read
        raise HertzchainError(
            f"{other}: has no forces of gauges over time, as the other files have: judge it by"
            " itself, or name its columns with --column"
        )
    options.refuse_without_need(of_traces, no_shift=traces.no_shift, column=bool(columns))
    with output.progress() as report_progress, output.compiling(report_progress):
        if of_traces:
            allowed = "are in the header of a trace, or named by --column 'gauge_16=CH1 [25 N]'"
            require(units is SI and step is None, "units and dt", None, allowed)
            how: dict[str, Any] = {
                "columns": columns,
                "shift": not traces.no_shift,
                "time_limit": limit,
                "progress": report_progress,
            }
            if loaded.uncertain:
                seen = SEEN if tolerance is None else tolerance
                outputs.end(of_validation(validate(loaded, results, tolerance=seen, **how)))
            within = TOLERANCE if tolerance is None else tolerance
            outputs.end(document_of(judge_traces(loaded, results, tolerance=within, **how)))
        if len(results) == 1 and is_train(names):
            allowed = "must be left out for pulses, whose forces are in N"
            require(units is SI and step is None, "units and dt", None, allowed)
            within = TOLERANCE if tolerance is None else tolerance
            limits: dict[str, Any] = {"time_limit": limit, "progress": report_progress}
            outputs.end(document_of(judge_trains(loaded, results[0], tolerance=within, **limits)))
        judgement = judge_peaks(
            loaded,
            results,
            units=units.value,
            tolerance=TOLERANCE if tolerance is None else tolerance,
            dt=step,
            time_limit=limit,
            progress=report_progress,
        )
    outputs.end(document_of(judgement))


@dataclass(frozen=True)
class FitOptions(options.TraceOptions):
    """Options of how a fit reads files of measured forces."""

    own_clocks: Annotated[
        bool,
        typer.Option(
            "--own-clocks",
            help="Each file has a clock of its own. Default: files of different gauges share one,"
            " as channels of one record.",
        ),
    ] = False
    hum: Annotated[
        str | None,
        typer.Option(metavar="HZ", help="Frequency of the hum of --free gauge_6.hum, such as 50."),
    ] = None

    @property
    def clock(self) -> str:
        """The clock of the files."""
        both = self.own_clocks and self.no_shift
        require(not both, "--own-clocks", None, "cannot go with --no-shift: leave one of them out")
        return "own" if self.own_clocks else "run" if self.no_shift else "shared"

    def with_hum(self, free: list[str]) -> list[str]:
        """Return free keys, those of hum with its frequency."""
        is_hum = [key.strip().endswith(".hum") for key in free]
        options.refuse_without_need(any(is_hum), hum=self.hum)
        hum = f"={self.hum}" if self.hum else ""
        return [key + hum if has_hum else key for key, has_hum in zip(free, is_hum, strict=True)]


_TIE = "chain.granules='0.2 / (2 * chain.radius)'"


def fit(
    scene: options.SceneFile,
    traces: list[Path] = typer.Argument(
        ...,
        metavar="FILE",
        help="Forces over time, as for judge: time_s, gauge_16_N, contact_10_N, wall_N,"
        " near_wall_N, or any with --column; or peaks: contact, peak_force_N; several files are"
        " fitted at once.",
    ),
    *,
    free: list[str] = typer.Option(
        ...,
        metavar="KEY",
        help="A key of the scene to be fitted, such as chain.young_modulus, with a range where"
        " wanted, KEY=LOW:HIGH; repeatable. gain: the ratio of measured to true forces, the same"
        " for all gauges; gauge_6.gain, .offset, .drift, .droop, .hum: of the gauge of a column.",
    ),
    tie: list[str] | None = typer.Option(
        None,
        metavar="KEY=FORMULA",
        help="A key that follows from others by a formula of their full names, in SI units;"
        f" repeatable. A fixed length: {_TIE}.",
    ),
    how: FitOptions,
    output: Path | None = typer.Option(
        None, "-o", "--output", metavar="FILE", help="Write the fitted scene (.toml)."
    ),
    time_limit: options.TimeLimitOfAll = "1 h",
    as_json: options.AsJson = False,
) -> None:
    """Fit values of a scene to measured forces or peaks.

    Values have 95 % intervals. The search starts from the values in the scene file. The status is
    1 if the residual is more than noise.
    """
    from hertzchain.fits import fit as fits

    check_files([scene, *traces], [output])
    limit = options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    ties = options.by_name("--tie", tie or [], _TIE)
    with progress() as report_progress, compiling(report_progress):
        fitted = fits.fit(
            loaded, traces, how.with_hum(free), ties=ties, columns=how.columns, clock=how.clock,
            time_limit=limit, progress=report_progress,
        )  # fmt: skip
    show(as_json, fitted.to_dict, lambda console: console.print(repr(fitted)))
    write_file("Scene", output, fitted.scene.to_toml)
    if not fitted.is_noise:
        raise typer.Exit(OUT_OF_TOLERANCE)


def spectrum(
    scene: options.SceneFile,
    *,
    gauge: str = typer.Option(
        ...,
        metavar="GAUGE",
        help="The granule whose force is wanted, such as 6; or contact_10, wall, near_wall.",
    ),
    time_limit: options.TimeLimit = "1 h",
    picture: options.PictureOptions,
    as_json: options.AsJson = False,
) -> None:
    """Show the amplitude spectrum of a force.

    A pressed chain of granules that are alike, or of two kinds in turn, also has the edges of its
    bands, by formulas. A later end_time in [run] makes the bins narrower.
    """
    from hertzchain.engines.native.backend import Native
    from hertzchain.pulses.spectrum import spectrum_of, times_of
    from hertzchain.report.spectrum import plot_spectrum, print_spectrum
    from hertzchain.verdict.traces import gauge_of

    check_files([scene], plot=picture.plot)
    inches, loaded = picture.inches, options.load_scene(scene)
    place = gauge_of(f"gauge_{gauge}" if gauge.isdecimal() else gauge, loaded, "--gauge")
    limit = options.to_time_limit(time_limit)
    with progress() as report_progress, compiling(report_progress):
        backend = Native(time_limit=limit, wanted="all")
        result = spectrum_of(backend.run(loaded, times_of(loaded)), place)
    show(as_json, result.to_dict, lambda console: print_spectrum(console, result))
    write_file("Plot", picture.plot, lambda path: plot_spectrum(result, inches).write(path))


def spread(
    scene: options.SceneFile,
    *,
    realisations: int = typer.Option(
        256,
        "-n",
        "--realisations",
        metavar="N",
        help="How many runs; the next power of two is taken. What each input causes needs 32 an"
        " input.",
    ),
    rtol: float = typer.Option(1e-4, help="Wanted relative accuracy of each run."),
    time_limit: options.TimeLimitOfAll = "1 h",
    output: Path | None = typer.Option(
        None, "-o", "--output", help="Write the spread of all results (.csv, .parquet, .json)."
    ),
    picture: options.PictureOptions,
    every: options.EveryContact = False,
    as_json: options.AsJson = False,
) -> None:
    """Show what uncertain values do to the results.

    The scene is run many times, with values drawn from its [uncertainty] and [scatter].
    """
    from hertzchain.report.files import check_format, write_result
    from hertzchain.uncertainty import spread as spreads
    from hertzchain.uncertainty.spread import plot_spread, print_spread

    check_format(output, "result")
    check_files([scene], result=output, plot=picture.plot)
    inches, loaded = picture.inches, options.load_scene(scene)
    limit = options.to_time_limit(time_limit)
    with progress() as report_progress, compiling(report_progress):
        results = spreads.spread(
            loaded, realisations, rtol=rtol, time_limit=limit, progress=report_progress
        )
    show(as_json, results.to_dict, lambda console: print_spread(console, results, every))
    write_file("Spread", output, lambda path: write_result(results, path))
    write_file("Plot", picture.plot, lambda path: plot_spread(results, inches).write(path))
