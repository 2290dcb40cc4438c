"""hertzchain deck, lint, unit-test, examine and certify: decks, and codes that read them."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal

import typer

from hertzchain.cli import options, output
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, print_json, progress, write_file
from hertzchain.cli.shown import Shown
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import on_one_line
from hertzchain.limits import TOLERANCE

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
    )
    check_outputs([scene], [output])
    longest = options.to_seconds("--dt", dt)
    with progress() as report_progress:
        report_progress("native: time step and expected peaks of the deck")
        if engine is LAMMPS:
            text = answer.lammps_deck(
                loaded, longest, rtol, scene.stem, watch_every=watch_every,
                pair_style=pair_style.value,
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

    from hertzchain.examiner.lint import lint_file

    given = options.by_name("--var", variables or [], "F0=100")
    limit = options.to_time_limit(time_limit)
    by_deck = {str(path): lint_file(path, given, limit) for path in decks}
    if as_json:
        files = [
            {"file": file, "findings": [asdict(finding) for finding in findings]}
            for file, findings in by_deck.items()
        ]
        print_json({"decks": files})
    for file, findings in by_deck.items():
        for finding in () if as_json else findings:
            where = f"{file}:{finding.line}: {finding.severity}"
            typer.echo(on_one_line(f"{where}: {finding.text} [{finding.rule}]"))
    severities = [finding.severity for findings in by_deck.values() for finding in findings]
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
        report_progress("native: motion of the wave")
        motion = known_motion(loaded)
    text = test_text(motion, f"A chain of spheres, scene {scene.stem}", time.ctime())
    _write("test", output, text)


def _write(what: str, path: Path | None, text: str) -> None:
    from hertzchain.files import write_text

    if path is None:
        typer.echo(text, nl=False)
    write_file(what, path, lambda path: write_text(path, text))


@dataclass(frozen=True)
class ReadingOptions:
    """Options of how LAMMPS reads and runs a deck."""

    variables: options.Variables = None
    lmp: options.LammpsBinary = None
    time_limit: options.TimeLimit = "1 h"


def examine(
    scene: options.SceneFile,
    deck: Path = typer.Argument(..., metavar="DECK", help="LAMMPS input file."),
    *,
    reading: ReadingOptions,
    tolerance: options.Tolerance = TOLERANCE,
    strict: bool = typer.Option(
        False, "--strict", help="Also fail differences that change no peak."
    ),
    shown: options.VerdictOptions,
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
    from hertzchain.report.documents import of_examination

    outputs = Shown(scene, shown, [deck], others={"": fix})
    given = options.by_name("--var", reading.variables or [], "F0=100")
    limit = options.to_time_limit(reading.time_limit)
    loaded = options.load_scene(scene)
    with output.progress() as report_progress, output.compiling(report_progress):
        examination = examined(
            loaded,
            deck,
            given,
            tolerance=tolerance,
            lmp=options.named_binary(reading.lmp),
            time_limit=limit,
            strict=strict,
            progress=report_progress,
        )
    if examination.edits:
        output.write_file("Deck", fix, lambda path: write_text(path, examination.fix))
    elif fix is not None:
        output.say(f"{fix} is not written: there is no correction")
    outputs.end(of_examination(examination))


def certify(
    lmp: list[str] | None = typer.Option(
        None,
        metavar="PROGRAM",
        help="A LAMMPS binary of any version, liggghts or yade, repeatable; without one the lammps"
        " module."
        f" [env var: {options.LMP}]",
    ),
    suffix: Literal["omp", "kk", "intel", "gpu"] | None = typer.Option(
        None, help="Accelerated styles, as LAMMPS's -sf chooses them."
    ),
    ranks: options.Ranks = None,
    folder: Path | None = typer.Option(
        None,
        "-o",
        "--output",
        metavar="DIR",
        help="Write decks, scenes, certify.json and certify.xml.",
    ),
    as_json: options.AsJson = False,
    junit: options.Junit = None,
) -> None:
    """Compare a build of LAMMPS, LIGGGHTS or Yade with native.

    There is a short scene for each thing that can be wrong in a build. A row is right to round-off,
    right to the steps (its difference is below their error), wrong by a stated amount, not
    supported by this code, or not tested: where a suffix has no such style, LAMMPS runs the plain
    one. Status 0: all that was tested is right; 1: a row is wrong; 2: rows could not run.
    """
    from hertzchain.files import check_outputs, make_folder, write_text
    from hertzchain.known.certificate import certify as measure
    from hertzchain.report.console import print_certificates, suite
    from hertzchain.report.document import to_xml

    check_outputs([], [junit])
    if folder is not None:
        make_folder(folder)
    begun, certificates = datetime.now(UTC), []
    named: list[str | None] = [*lmp] if lmp else [options.named_binary(None)]
    with output.progress() as report_progress, output.compiling(report_progress):
        for k, program in enumerate(named, start=1):
            decks = folder
            if folder is not None and len(named) > 1:  # decks differ from version to version
                decks = folder / f"{k}"
                make_folder(decks)
            count = 1 if ranks is None else ranks
            certificates.append(
                measure(program, suffix=suffix, ranks=count, folder=decks, progress=report_progress)
            )
    statuses = [certificate.status for certificate in certificates]
    status = 1 if 1 in statuses else max(statuses)
    document = {
        "hertzchain": version("hertzchain"),
        "status": status,
        "certificates": [certificate.to_dict() for certificate in certificates],
    }
    output.show(
        as_json, lambda: document, lambda console: print_certificates(console, certificates)
    )
    xml = to_xml([suite(certificate, begun) for certificate in certificates])
    if folder is not None:
        write_text(folder / "certify.json", json.dumps(document, indent=2, allow_nan=False))
        write_text(folder / "certify.xml", xml)
    output.write_file("JUnit XML", junit, lambda path: write_text(path, xml))
    raise typer.Exit(status)
