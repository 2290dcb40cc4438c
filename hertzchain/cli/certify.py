"""hertzchain certify: a LAMMPS, LIGGGHTS or Yade compared with native."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import typer

from hertzchain.cli import options, output


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
    from hertzchain.report.certificate import print_certificates, suite
    from hertzchain.report.junit import to_xml

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
