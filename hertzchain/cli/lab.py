"""hertzchain pulse, judge, fit, spectrum and spread: measured forces, and what is uncertain."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from hertzchain.cli import options
from hertzchain.cli.options import to_seconds
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, Answer, Written, working
from hertzchain.errors import HertzchainError, require
from hertzchain.limits import TOLERANCE


@dataclass(frozen=True)
class ColumnOptions:
    """How the columns of a recording are read.

    Options
    -------
    time COLUMN: Name or number of the column of times. Default: the first.
    force COLUMN: Name or number of the column of forces. Default: the next.
    time_unit UNIT: Unit of the times. Default: that of the header, or s.
    scale: N for each unit of the column, such as N per volt; may be negative.
    """

    time: str | None = None
    force: str | None = None
    time_unit: str | None = None
    scale: float | None = None


@dataclass(frozen=True)
class PartOptions:
    """Which part of a recording is the pulse.

    Options
    -------
    baseline: Value of the column without a force, in its unit. Default: its mean before the pulse.
    start TIME: Where the pulse starts in the file, seconds or with a unit ("-20 us"). Default:
        where it leaves the noise.
    end TIME: Where the pulse ends. Default: where it is back in the noise.
    """

    baseline: float | None = None
    start: str | None = None
    end: str | None = None


def pulse(
    recording: Path,
    *,
    output: Path | None = None,
    column: ColumnOptions,
    part: PartOptions,
    rows: int = 80,
    picture: options.PictureOptions,
) -> Answer:
    """Make a pulse table of a recorded force.

    The table has no baseline, begins and ends with the pulse, and has few rows. The command says
    what was changed, and how well F0 and impulse are known. Comments, header, separator and decimal
    commas are recognised.

    Options
    -------
    recording RECORDING: Text file of an oscilloscope: columns of time and force.
    output FILE: Write the pulse table (CSV) of a scene.
    rows: Most rows of the table.
    """
    from hertzchain.files import write_text
    from hertzchain.pulses.pulse import measured_pulse, pulse_of
    from hertzchain.pulses.recording import read_recording
    from hertzchain.report.signals import plot_pulse, print_pulse

    ends = to_seconds("--start", part.start), to_seconds("--end", part.end)
    read = read_recording(recording, column.time, column.force, column.time_unit, column.scale)
    with working(is_native=False) as report_progress:
        report_progress("choosing the fewest rows that keep the pulse")
        measured = measured_pulse(read, pulse_of(read, part.baseline, *ends), rows)
    remarks = [*measured.signal.warnings]
    if output is not None:
        file = json.dumps(output.name, ensure_ascii=False)
        remarks.append(
            f"a scene next to {output} takes it under [shock] as"
            f' profile = "table" and file = {file}'
        )
    return Answer(
        measured.to_dict,
        lambda console: print_pulse(console, measured),
        [
            Written("Pulse table", output, lambda path: write_text(path, measured.to_text())),
            picture.picture(lambda size: plot_pulse(measured, size)),
        ],
        remarks,
    )


Units = StrEnum("Units", {name: name for name in ("si", "cgs", "micro", "nano")})  # type: ignore[misc]
"""LAMMPS's styles of units."""

SI = Units("si")


def judge(
    scene: Path,
    results: list[Path],
    *,
    traces: options.TraceOptions,
    units: Units = SI,
    dt: str | None = None,
    tolerance: float | None = None,
    time_limit: str = "1 h",
    shown: options.VerdictOptions,
) -> Answer:
    """Judge the peaks of any code, or measured forces.

    Where peaks differ, the likely cause is named.

    Options
    -------
    results FILE: CSV with the columns contact, peak_force_N; or a LAMMPS dump of all granules with
        id, x, fx (all files of one dump); or measured traces: time_s, gauge_16_N, contact_10_N,
        wall_N, near_wall_N, or any with --column (also a file for each channel of a record); or
        measured pulses: contact or granule, force_N, perhaps time_s and width_s.
    units: Units of a dump, by LAMMPS's name.
    dt TIME: The step of the code, seconds or with a unit ("20 ns").
    tolerance: Largest relative difference that passes, 0.001 unless given. Of a scene with
        [uncertainty]: one that must be detected, 0.1 unless given.
    """
    from hertzchain.lab.validation import SEEN, Validation, of_validation, validate
    from hertzchain.pulses.recording import read_columns
    from hertzchain.report.contents import document_of
    from hertzchain.verdict.results import is_train, judge_trains
    from hertzchain.verdict.results import judge as judge_peaks
    from hertzchain.verdict.traces import is_traces, judge_traces, names_in

    columns = traces.columns
    step, limit = options.to_seconds("--dt", dt), options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    are_traces = [is_traces(names_in(file), columns) for file in results]
    if any(are_traces) and not all(are_traces):
        other = results[are_traces.index(False)]
        read_columns(other)  # raises where it cannot be read
        raise HertzchainError(
            f"{other}: has no forces of gauges over time, as the other files have: judge it by"
            " itself, or name its columns with --column"
        )
    options.refuse_without_need(all(are_traces), no_shift=traces.no_shift, column=bool(columns))
    of_train = len(results) == 1 and is_train(names_in(results[0]))
    if all(are_traces) or of_train:
        allowed = "are for peaks: other files say their units"
        require(units is SI and step is None, "units and dt", None, allowed)
    least = SEEN if all(are_traces) and loaded.uncertain else TOLERANCE
    how: dict[str, Any] = {"tolerance": least if tolerance is None else tolerance}
    with working() as report_progress:
        how |= {"time_limit": limit, "progress": report_progress}
        judged: object
        if all(are_traces):
            judge_all = validate if loaded.uncertain else judge_traces
            judged = judge_all(loaded, results, columns=columns, shift=not traces.no_shift, **how)
        elif of_train:
            judged = judge_trains(loaded, results[0], **how)
        else:
            judged = judge_peaks(loaded, results, units=units.value, dt=step, **how)
    document = of_validation(judged) if isinstance(judged, Validation) else document_of(judged)
    return shown.answer(document, scene, [results[0], results[-1]])


@dataclass(frozen=True)
class FitOptions(options.TraceOptions):
    """How a fit reads files of measured forces.

    Options
    -------
    own_clocks: Each file has a clock of its own. Default: files of different gauges share one, as
        channels of one record.
    """

    own_clocks: bool = False

    @property
    def clock(self) -> str:
        """The clock of the files."""
        both = self.own_clocks and self.no_shift
        require(not both, "--own-clocks", None, "cannot go with --no-shift: leave one of them out")
        return "own" if self.own_clocks else "run" if self.no_shift else "shared"


def fit(
    scene: Path,
    files: list[Path],
    *,
    free: list[str],
    how: FitOptions,
    output: Path | None = None,
    time_limit: str = "1 h",
) -> Answer:
    """Fit values of a scene to measured forces or peaks.

    Values have 95 % intervals. The search starts from the values in the scene file. The status is
    1 if the residual is more than noise.

    Options
    -------
    files FILE: Forces over time, as for judge: time_s, gauge_16_N, contact_10_N, wall_N,
        near_wall_N, or any with --column; or peaks: contact, peak_force_N; several files are fitted
        at once.
    free KEY: A key of the scene to be fitted, such as chain.young_modulus, with a range where
        wanted, KEY=LOW:HIGH; repeatable. gain: the ratio of measured to true forces, the same for
        all gauges; gauge_6.gain, .offset, .drift: of the gauge of a column.
    output FILE: Write the fitted scene (.toml).
    time_limit TIME: How long all runs together may take, seconds or with a unit ("10 min").
    """
    from hertzchain.lab import fit as fits

    limit = options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    with working() as report_progress:
        fitted = fits.fit(
            loaded, files, free, columns=how.columns, clock=how.clock,
            time_limit=limit, progress=report_progress,
        )  # fmt: skip
    return Answer(
        fitted.to_dict,
        lambda console: console.print(repr(fitted)),
        [Written("Scene", output, fitted.scene.to_toml)],
        status=DONE if fitted.is_noise else OUT_OF_TOLERANCE,
    )


def spectrum(
    scene: Path, *, gauge: str, time_limit: str = "1 h", picture: options.PictureOptions
) -> Answer:
    """Show the amplitude spectrum of a force.

    A pressed chain of granules that are alike, or of two kinds in turn, also has the edges of its
    bands, by formulas. A later end_time in [run] makes the bins narrower.

    Options
    -------
    gauge GAUGE: The granule whose force is wanted, such as 6; or contact_10, wall, near_wall.
    """
    from hertzchain.engines.native.backend import Native
    from hertzchain.pulses.spectrum import spectrum_of, times_of
    from hertzchain.report.signals import plot_spectrum, print_spectrum
    from hertzchain.verdict.traces import gauge_of

    loaded = options.load_scene(scene)
    place = gauge_of(f"gauge_{gauge}" if gauge.isdecimal() else gauge, loaded, "--gauge")
    backend = Native(time_limit=options.to_time_limit(time_limit), wanted="all")
    with working():
        result = spectrum_of(backend.run(loaded, times_of(loaded)), place)
    return Answer(
        result.to_dict,
        lambda console: print_spectrum(console, result),
        [picture.picture(lambda size: plot_spectrum(result, size))],
    )


def spread(
    scene: Path,
    *,
    realisations: int = 256,
    rtol: float = 1e-4,
    time_limit: str = "1 h",
    output: Path | None = None,
    picture: options.PictureOptions,
    every: bool = False,
) -> Answer:
    """Show what uncertain values do to the results.

    The scene is run many times, with values drawn from its [uncertainty] and [scatter].

    Options
    -------
    realisations N: How many runs; the next power of two is taken. What each input causes needs 32
        an input.
    rtol: Wanted relative accuracy of each run.
    time_limit TIME: How long all runs together may take, seconds or with a unit ("10 min").
    output: Write the spread of all results (.csv, .parquet, .json).
    """
    from hertzchain.lab import spread as spreads
    from hertzchain.lab.spread import plot_spread, print_spread
    from hertzchain.report.files import check_format, write_result

    check_format(output, "result")
    loaded, limit = options.load_scene(scene), options.to_time_limit(time_limit)
    with working() as report_progress:
        results = spreads.spread(
            loaded, realisations, rtol=rtol, time_limit=limit, progress=report_progress
        )
    return Answer(
        results.to_dict,
        lambda console: print_spread(console, results, every),
        [
            Written("Spread", output, lambda path: write_result(results, path)),
            picture.picture(lambda size: plot_spread(results, size)),
        ],
    )
