"""hertzchain pulse: a measured pulse made into a pulse table."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli.options import (
    AsJson,
    Size,
    refuse_without_need,
    remark_on_units,
    to_inches,
    to_seconds,
)
from hertzchain.cli.output import check_files, compiling, progress, say, show, write_file


def pulse(
    recording: Path = typer.Argument(
        ..., metavar="RECORDING", help="Text file of an oscilloscope: columns of time and force."
    ),
    output: Path | None = typer.Option(
        None, "-o", "--output", metavar="FILE", help="Write the pulse table (CSV) of a scene."
    ),
    time: str | None = typer.Option(
        None, metavar="COLUMN", help="Name or number of the column of times. Default: the first."
    ),
    force: str | None = typer.Option(
        None, metavar="COLUMN", help="Name or number of the column of forces. Default: the next."
    ),
    time_unit: str | None = typer.Option(
        None, metavar="UNIT", help="Of the times. Default: what the header says, or s."
    ),
    scale: str | None = typer.Option(
        None,
        metavar="FLOAT",
        help="N for each unit of the column, such as N per volt; may be negative.",
    ),
    baseline: str | None = typer.Option(
        None,
        metavar="FLOAT",
        help="What the column has without a force. Default: its mean before the pulse.",
    ),
    start: str | None = typer.Option(
        None,
        metavar="TIME",
        help='Where the pulse starts in the file, seconds or with a unit ("-20 us"). Default:'
        " where it leaves the noise.",
    ),
    end: str | None = typer.Option(
        None, metavar="TIME", help="Where it ends. Default: where it is back in the noise."
    ),
    scene: Path | None = typer.Option(
        None,
        metavar="SCENE",
        help="What the pulse is for, whatever shock the file has: says what noise and fewer"
        " rows do to the peaks.",
    ),
    rtol: float = typer.Option(1e-3, help="How much fewer rows may change the peaks."),
    plot: Path | None = typer.Option(
        None, metavar="FILE", help="Draw recording, baseline and rows (png, pdf, svg)."
    ),
    size: Size = None,
    as_json: AsJson = False,
) -> None:
    """Make a pulse table of a recording: without baseline, from start to end, with few rows.

    Says what was changed, and what noise does to F0 and impulse and, with --scene, to LM_ratio and
    the peaks. Comments, header, separator and decimal commas are told from the file.
    """
    import json

    from hertzchain.files import write_text
    from hertzchain.pulses.measured import check_accuracy, measured_pulse
    from hertzchain.pulses.recording import read_recording
    from hertzchain.pulses.signal import Given, pulse_of
    from hertzchain.report.pulse import plot_pulse, print_pulse

    check_files([recording, scene], [output], plot=plot)
    check_accuracy(rtol)
    refuse_without_need(plot is not None, size=size is not None)
    inches = to_inches(size)
    given = Given(
        _number("--baseline", baseline, "in the unit of the column"),
        to_seconds("--start", start),
        to_seconds("--end", end),
    )
    newtons = _number("--scale", scale, "N for each unit of the column, as 25 for 25 N per volt")
    read = read_recording(recording, time, force, time_unit, newtons)
    signal = pulse_of(read, given)
    loaded = None
    if scene is not None:
        from hertzchain.pulses.measured import table_of
        from hertzchain.scene.scene import Scene

        loaded = Scene.from_toml(scene, shock=table_of(signal))
        remark_on_units(loaded)
    with progress() as report_progress, compiling(report_progress, loaded is not None):
        report_progress("looking for few rows that keep the pulse")
        found = measured_pulse(read, signal, rtol, loaded)
    if output is not None:
        write_text(output, found.to_text())
    show(as_json, found.to_dict, lambda console: print_pulse(console, found))
    for warning in signal.warnings:
        say(warning)
    if output is not None:
        typer.echo(
            f"Pulse table written to {output}; a scene next to it takes it under [shock] as"
            f' profile = "table" and file = {json.dumps(output.name, ensure_ascii=False)}',
            err=True,
        )
    write_file("Plot", plot, lambda path: plot_pulse(found, path, inches))


def _number(option: str, given: str | None, unit: str) -> float | None:
    """The number that an option says, in a unit that its words name."""
    from hertzchain.errors import SceneError

    try:
        return None if given is None else float(given)
    except ValueError:
        raise SceneError(option, given, f"must be a number alone, {unit}") from None
