"""hertzchain doctor: a diagnosis of this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from hertzchain.cli.output import DONE, UNUSABLE


def doctor(
    compiling: Annotated[
        bool,
        typer.Option(
            "--compile",
            help="Compile the kernels of uniform chains now, for runs and sweeps; a minute, once.",
        ),
    ] = False,
) -> None:
    """Report what is installed, what works, and what to do about the rest."""
    from hertzchain.cli.diagnosis import compile_kernels, diagnose

    if compiling:
        compile_kernels()
    findings = diagnose()
    for finding in findings:
        mark = "ok  " if finding.works else "FAIL" if finding.needed else "--  "
        typer.echo(f"{mark}  {finding.name}: {finding.text}")
    usable = all(finding.works for finding in findings if finding.needed)
    raise typer.Exit(DONE if usable else UNUSABLE)
