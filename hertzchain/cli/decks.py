"""hertzchain deck, lint, unit-test, examine and certify: decks, and codes that read them."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from hertzchain.cli import options
from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, Answer, Written, working
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import on_one_line
from hertzchain.limits import TOLERANCE

if TYPE_CHECKING:
    from rich.console import Console

Engine = StrEnum(  # type: ignore[misc]
    "Engine", {name.upper(): name for name, engine in ENGINES.items() if engine.writes_decks}
)
PairStyle = StrEnum("PairStyle", {style: style for style in PAIR_STYLES})  # type: ignore[misc]
LAMMPS, GRANULAR = Engine("lammps"), PairStyle("granular")


def deck(
    scene: Path,
    *,
    engine: Engine = LAMMPS,
    output: Path | None = None,
    rtol: float | None = None,
    dt: str | None = None,
    watch_every: int | None = None,
    pair_style: PairStyle = GRANULAR,
) -> list[Written]:
    """Write a deck of a scene for LAMMPS, LIGGGHTS or Yade.

    The deck finds the peak forces by itself. A deck for LAMMPS compares them with the true ones and
    says PASS or FAIL; the others write peaks.csv for hertzchain judge. Pair style
    gran/hertz/history is for elastic granules of one material.

    Options
    -------
    engine: Code that runs the deck.
    rtol: Relative error of the peaks by the step. Default: 1e-6, with damped contacts 1e-4.
    watch_every STEPS: Steps between two samples of the overlaps. Default: 0.005 natural time units.
    pair_style: Pair style of LAMMPS for Hertz's law.
    """
    from hertzchain.known import answer

    loaded = options.load_scene(scene)
    options.refuse_step_and_accuracy(rtol, dt)
    options.refuse_without_need(
        engine is LAMMPS,
        watch_every=watch_every is not None,
        pair_style=pair_style is not GRANULAR,
    )
    longest = options.to_seconds("--dt", dt)
    with working() as report_progress:
        report_progress("native: time step and expected peaks of the deck")
        if engine is LAMMPS:
            text = answer.lammps_deck(
                loaded, longest, rtol, scene.stem, watch_every=watch_every,
                pair_style=pair_style.value,
                name="THIS_FILE" if output is None else output.name,
            )  # fmt: skip
        else:
            text = answer.program_deck(engine.value, loaded, longest, rtol, scene.stem)
    return _printed_or_written("deck", output, text)


def lint(
    decks: list[Path], *, variables: list[str] | None = None, time_limit: str = "1 min"
) -> Answer:
    """Find known traps in any LAMMPS deck of a chain.

    The status is 1 if there is one. Notes, on lost time or on what may be intended, leave the
    status at 0. LAMMPS reads the deck, and takes no step; without LAMMPS only the text is read.

    Options
    -------
    decks DECK: LAMMPS input files.
    """
    from dataclasses import asdict

    from hertzchain.examiner.lint import lint_file

    given = options.by_name("--var", variables, "F0=100")
    limit = options.to_time_limit(time_limit)
    by_deck = {str(path): lint_file(path, given, limit) for path in decks}
    severities = [finding.severity for findings in by_deck.values() for finding in findings]
    numbers = {kind: severities.count(kind) for kind in ("error", "warning", "note")}
    counts = ", ".join(f"{count} {kind}{'s' * (count != 1)}" for kind, count in numbers.items())

    def print_all(_: Console) -> None:
        for file, findings in by_deck.items():
            for finding in findings:
                where = f"{file}:{finding.line}: {finding.severity}"
                typer.echo(on_one_line(f"{where}: {finding.text} [{finding.rule}]"))
        typer.echo(counts)

    def to_dict() -> dict[str, object]:
        files = [
            {"file": file, "findings": [asdict(finding) for finding in findings]}
            for file, findings in by_deck.items()
        ]
        return {"decks": files}

    is_wrong = numbers["error"] + numbers["warning"] > 0
    return Answer(to_dict, print_all, status=OUT_OF_TOLERANCE if is_wrong else DONE)


def unit_test(scene: Path, *, output: Path | None = None) -> list[Written]:
    """Write a test of a scene for LAMMPS's own suite.

    The test has the wave or the impact of the scene, with its motion by Eq. 1. The file is of
    the form of unittest/granular/tests/dem02-*.yaml in the sources of LAMMPS.
    """
    from hertzchain.known.unit_test import known_motion
    from hertzchain.known.unit_test import unit_test as test_text

    loaded = options.load_scene(scene)
    with working() as report_progress:
        report_progress("native: motion of the wave")
        motion = known_motion(loaded)
    text = test_text(motion, f"A chain of spheres, scene {scene.stem}", time.ctime())
    return _printed_or_written("test", output, text)


def _printed_or_written(what: str, path: Path | None, text: str) -> list[Written]:
    from hertzchain.files import write_text

    if path is None:
        typer.echo(text, nl=False)
    return [Written(what, path, lambda path: write_text(path, text))]


@dataclass(frozen=True)
class ReadingOptions:
    """How LAMMPS reads and runs a deck."""

    variables: list[str] | None = None
    lmp: str | None = None
    time_limit: str = "1 h"


def examine(
    scene: Path,
    deck: Path,
    *,
    reading: ReadingOptions,
    tolerance: float = TOLERANCE,
    strict: bool = False,
    shown: options.VerdictOptions,
    fix: Path | None = None,
) -> Answer:
    """Examine a LAMMPS deck of a scene, and say what to correct.

    Every number is examined, then the peaks. LAMMPS reads and runs the deck in a separate process;
    no file of the deck's own is written.

    Options
    -------
    deck DECK: LAMMPS input file.
    strict: Also fail differences that change no peak.
    fix FILE: Write the deck with all proven corrections.
    """
    from hertzchain.examiner.examining import examine as examined
    from hertzchain.files import write_text
    from hertzchain.report.contents import document_of

    given = options.by_name("--var", reading.variables, "F0=100")
    limit = options.to_time_limit(reading.time_limit)
    loaded = options.load_scene(scene)
    with working() as report_progress:
        examination = examined(
            loaded, deck, given, tolerance=tolerance, lmp=options.named_binary(reading.lmp),
            time_limit=limit, strict=strict, progress=report_progress,
        )  # fmt: skip
    answer = shown.answer(document_of(examination), scene, [deck])
    corrected = Written("Deck", fix, lambda path: write_text(path, examination.fix))
    if examination.edits:
        return replace(answer, files=[corrected, *answer.files])
    said = f"{fix} is not written: there is no correction"
    return replace(answer, remarks=[said] if fix is not None else [])


def certify(
    *,
    lmp: list[str] | None = None,
    suffix: Literal["omp", "kk", "intel", "gpu"] | None = None,
    ranks: int | None = None,
    folder: Path | None = None,
    junit: Path | None = None,
) -> Answer:
    """Compare a build of LAMMPS, LIGGGHTS or Yade with native.

    There is a short scene for each thing that can be wrong in a build. A row is right to round-off,
    right to the steps (its difference is below their error), wrong by a stated amount, not
    supported by this code, or not tested: where a suffix has no such style, LAMMPS runs the plain
    one. Status 0: all that was tested is right; 1: a row is wrong; 2: rows could not run.

    Options
    -------
    lmp PROGRAM: A LAMMPS binary of any version, liggghts or yade, repeatable; without one the
        lammps module. [env var: HERTZCHAIN_LMP]
    suffix: Accelerated styles, as LAMMPS's -sf chooses them.
    folder DIR: Write decks, scenes, certify.json and certify.xml.
    """
    from hertzchain.files import make_folder, write_text
    from hertzchain.known.certificate import certify as measure
    from hertzchain.report.console import print_certificates, suite
    from hertzchain.report.document import to_xml

    begun, certificates = datetime.now(UTC), []
    named: list[str | None] = [*lmp] if lmp else [options.named_binary(None)]
    # Decks differ from version to version.
    folders: list[Path | None] = [folder] * len(named)
    if folder is not None and len(named) > 1:
        folders = [folder / f"{k}" for k in range(1, len(named) + 1)]
    for each in folders:
        if each is not None:
            make_folder(each)
    with working() as report_progress:
        for program, decks in zip(named, folders, strict=True):
            certificates.append(
                measure(
                    program, suffix=suffix, ranks=1 if ranks is None else ranks, folder=decks,
                    progress=report_progress,
                )
            )  # fmt: skip
    statuses = [certificate.status for certificate in certificates]
    status = 1 if 1 in statuses else max(statuses)
    document = {
        "hertzchain": version("hertzchain"),
        "status": status,
        "certificates": [certificate.to_dict() for certificate in certificates],
    }
    xml = to_xml([suite(certificate, begun) for certificate in certificates])
    if folder is not None:
        write_text(folder / "certify.json", json.dumps(document, indent=2, allow_nan=False))
        write_text(folder / "certify.xml", xml)
    return Answer(
        lambda: document,
        lambda console: print_certificates(console, certificates),
        [Written("JUnit XML", junit, lambda path: write_text(path, xml))],
        status=status,
    )
