"""hertzchain examine: a user's LAMMPS deck against a scene."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli import options, output
from hertzchain.cli.shown import Shown
from hertzchain.limits import TOLERANCE


def examine(
    scene: options.SceneFile,
    deck: Path = typer.Argument(..., metavar="DECK", help="LAMMPS input file."),
    variables: options.Variables = None,
    lmp: options.LammpsBinary = None,
    tolerance: options.Tolerance = TOLERANCE,
    time_limit: options.TimeLimit = "1 h",
    strict: bool = typer.Option(
        False, "--strict", help="Also fail differences that change no peak."
    ),
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
    fix: Path | None = typer.Option(
        None, metavar="FILE", help="Write the deck with all proven corrections."
    ),
) -> None:
    """Examine a LAMMPS deck of a scene, and say what to correct.

    Every number is examined, then the peaks. LAMMPS reads and runs the deck in a separate process;
    no file of the deck's own is written.
    """
    from hertzchain.examiner.examining import examine as examined
    from hertzchain.files import write_text
    from hertzchain.report.examination import of_examination

    shown = Shown(scene, [deck], as_json, plot, report, junit, size=size, others={"": fix})
    given = options.by_name("--var", variables or [], "F0=100")
    limit = options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    with output.progress() as report_progress, output.compiling(report_progress):
        examination = examined(
            loaded,
            deck,
            given,
            tolerance=tolerance,
            lmp=options.named_binary(lmp),
            time_limit=limit,
            strict=strict,
            progress=report_progress,
        )
    if examination.edits:
        output.write_file("Deck", fix, lambda path: write_text(path, examination.fix))
    elif fix is not None:
        output.say(f"{fix} is not written: there is no correction")
    shown.end(of_examination(examination))
