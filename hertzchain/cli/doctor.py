"""hertzchain doctor: a diagnosis of this machine."""

from __future__ import annotations

import typer

from hertzchain.cli.output import DONE, UNUSABLE, say
from hertzchain.errors import RunFailed


def doctor(
    compiling: bool = typer.Option(
        False,
        "--compile",
        help="Compile the kernels of uniform chains now, for runs and sweeps; 20 s, once.",
    ),
) -> None:
    """Report what is installed, what works, and what to do about the rest."""
    from hertzchain.cli.diagnosis import compile_kernels, diagnose

    compiled = True
    if compiling:
        try:
            compile_kernels()
        except RunFailed as problem:
            say(str(problem))
            compiled = False
    findings = diagnose()
    for finding in findings:
        mark = "ok  " if finding.works else "FAIL" if finding.needed else "--  "
        typer.echo(f"{mark}  {finding.name}: {finding.text}")
    usable = all(finding.works for finding in findings if finding.needed)
    raise typer.Exit(DONE if usable and compiled else UNUSABLE)
