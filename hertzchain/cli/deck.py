"""hertzchain deck, lint and unit-test: writing and checking input of LAMMPS and similar codes."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hertzchain.cli import options
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, print_json, progress, write_file
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import on_one_line

Engine = StrEnum(  # type: ignore[misc]
    "Engine", {name.upper(): name for name, engine in ENGINES.items() if engine.writes_decks}
)
PairStyle = StrEnum("PairStyle", {style: style for style in PAIR_STYLES})  # type: ignore[misc]
LAMMPS, GRANULAR = Engine("lammps"), PairStyle("granular")

OutputFile = Annotated[
    Path | None, typer.Option("-o", "--output", help="File to write; stdout by default.")
]


def deck(
    scene: options.SceneFile,
    engine: Engine = typer.Option(LAMMPS, help="Code that runs the deck."),
    output: OutputFile = None,
    rtol: float | None = typer.Option(
        None,
        help="Relative error of the peaks by the step. Default: 1e-6, with damped contacts 1e-4.",
    ),
    dt: options.LargestStep = None,
    watch_every: int | None = typer.Option(
        None,
        metavar="STEPS",
        help="Steps between two samples of the overlaps; 0: none, and no verdict. Default: 0.005"
        " natural time units.",
    ),
    pair_style: PairStyle = typer.Option(GRANULAR, help="Pair style of LAMMPS for Hertz's law."),
    dump_every: int = typer.Option(
        0, metavar="STEPS", help="Steps between two states for OVITO; 0: none."
    ),
) -> None:
    """Write a deck of a scene for LAMMPS, LIGGGHTS or Yade.

    The deck finds the peak forces by itself. A deck for LAMMPS compares them with the true ones and
    says PASS or FAIL; the others write peaks.csv for hertzchain judge. Pair style
    gran/hertz/history is for granules of one material, elastic or with viscoelastic damping.
    """
    from hertzchain.files import check_outputs
    from hertzchain.known import answer

    loaded = options.load_scene(scene)
    options.refuse_step_and_accuracy(rtol, dt)
    options.refuse_without_need(
        engine is LAMMPS,
        watch_every=watch_every is not None,
        pair_style=pair_style is not GRANULAR,
        dump_every=dump_every != 0,
    )
    check_outputs([scene], [output])
    longest = options.to_seconds("--dt", dt)
    with progress() as report_progress:
        report_progress("native: the step, and what the deck has to find")
        if engine is LAMMPS:
            text = answer.lammps_deck(
                loaded, longest, rtol, scene.stem, watch_every=watch_every,
                pair_style=pair_style.value, dump_every=dump_every,
                name="THIS_FILE" if output is None else output.name,
            )  # fmt: skip
        else:
            text = answer.program_deck(engine.value, loaded, longest, rtol, scene.stem)
    _write("deck", output, text)


def lint(
    decks: list[Path] = typer.Argument(..., metavar="DECK", help="LAMMPS input files."),
    variables: options.Variables = None,
    time_limit: options.TimeLimit = "1 min",
    as_json: options.AsJson = False,
) -> None:
    """Find known traps in any LAMMPS deck of a chain.

    The status is 1 if there is one. Notes, on lost time or on what may be intended, leave the
    status at 0. LAMMPS reads the deck, and takes no step; without LAMMPS only the text is read.
    """
    from dataclasses import asdict

    from hertzchain.examiner.lint.rules import lint_file

    given = options.by_name("--var", variables or [], "F0=100")
    limit = options.to_time_limit(time_limit)
    found = {str(path): lint_file(path, given, limit) for path in decks}
    if as_json:
        files = [
            {"file": file, "findings": [asdict(finding) for finding in findings]}
            for file, findings in found.items()
        ]
        print_json({"decks": files})
    for file, findings in found.items():
        for finding in () if as_json else findings:
            where = f"{file}:{finding.line}: {finding.severity}"
            typer.echo(on_one_line(f"{where}: {finding.text} [{finding.rule}]"))
    severities = [finding.severity for findings in found.values() for finding in findings]
    numbers = {kind: severities.count(kind) for kind in ("error", "warning", "note")}
    counts = [f"{count} {kind}{'s' * (count != 1)}" for kind, count in numbers.items()]
    typer.echo(", ".join(counts), err=as_json)
    raise typer.Exit(OUT_OF_TOLERANCE if {"error", "warning"} & set(severities) else DONE)


def unit_test(scene: options.SceneFile, output: OutputFile = None) -> None:
    """Write a test of a scene for LAMMPS's own suite.

    The test has the wave or the impact of the scene, with its motion by Eq. 1. The file is of
    the form of unittest/granular/tests/dem02-*.yaml in the sources of LAMMPS.
    """
    from hertzchain.files import check_outputs
    from hertzchain.known.unit_test import known_motion
    from hertzchain.known.unit_test import unit_test as test_text

    loaded = options.load_scene(scene)
    check_outputs([scene], [output])
    with progress() as report_progress:
        report_progress("native: looking for the wave")
        motion = known_motion(loaded)
    text = test_text(motion, f"A chain of spheres, scene {scene.stem}", time.ctime())
    _write("test", output, text)


def _write(what: str, path: Path | None, text: str) -> None:
    from hertzchain.files import write_text

    if path is None:
        typer.echo(text, nl=False)
    write_file(what, path, lambda path: write_text(path, text))
