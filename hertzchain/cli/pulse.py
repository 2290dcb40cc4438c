"""hertzchain pulse: a pulse table from a measured pulse."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli.options import AsJson, Size, refuse_without_need, to_inches, to_seconds
from hertzchain.cli.output import check_files, progress, say, show, write_file


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
        None, metavar="UNIT", help="Unit of the times. Default: that of the header, or s."
    ),
    scale: float | None = typer.Option(
        None, help="N for each unit of the column, such as N per volt; may be negative."
    ),
    baseline: float | None = typer.Option(
        None,
        help="Value of the column without a force, in its unit. Default: its mean before the"
        " pulse.",
    ),
    start: str | None = typer.Option(
        None,
        metavar="TIME",
        help='Where the pulse starts in the file, seconds or with a unit ("-20 us"). Default:'
        " where it leaves the noise.",
    ),
    end: str | None = typer.Option(
        None, metavar="TIME", help="Where the pulse ends. Default: where it is back in the noise."
    ),
    rows: int = typer.Option(80, help="Most rows of the table."),
    plot: Path | None = typer.Option(
        None, metavar="FILE", help="Draw recording, baseline and rows (png, pdf, svg)."
    ),
    size: Size = None,
    as_json: AsJson = False,
) -> None:
    """Make a pulse table of a recorded force.

    The table has no baseline, begins and ends with the pulse, and has few rows. The command says
    what was changed, and how well F0 and impulse are known. Comments, header, separator and decimal
    commas are recognised.
    """
    import json

    from hertzchain.files import write_text
    from hertzchain.pulses.measured import measured_pulse
    from hertzchain.pulses.recording import read_recording
    from hertzchain.pulses.signal import pulse_of
    from hertzchain.report.pulse import plot_pulse, print_pulse

    check_files([recording], [output], plot=plot)
    refuse_without_need(plot is not None, size=size is not None)
    inches = to_inches(size)
    ends = to_seconds("--start", start), to_seconds("--end", end)
    read = read_recording(recording, time, force, time_unit, scale)
    with progress() as report_progress:
        report_progress("looking for few rows that keep the pulse")
        found = measured_pulse(read, pulse_of(read, baseline, *ends), rows)
    if output is not None:
        write_text(output, found.to_text())
    show(as_json, found.to_dict, lambda console: print_pulse(console, found))
    for warning in found.signal.warnings:
        say(warning)
    if output is not None:
        say(
            f"Pulse table written to {output}; a scene next to it takes it under [shock] as"
            f' profile = "table" and file = {json.dumps(output.name, ensure_ascii=False)}',
            "",
        )
    write_file("Plot", plot, lambda path: plot_pulse(found, inches).write(path))
