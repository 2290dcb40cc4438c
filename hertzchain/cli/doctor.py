"""hertzchain doctor: a diagnosis of this machine."""

from __future__ import annotations

import typer

from hertzchain.cli.output import DONE, UNUSABLE


def doctor() -> None:
    """Report what is installed, what works, and what to do about the rest."""
    from hertzchain.cli.diagnosis import diagnose

    findings = diagnose()
    for finding in findings:
        mark = "ok  " if finding.works else "FAIL" if finding.needed else "--  "
        typer.echo(f"{mark}  {finding.name}: {finding.text}")
    usable = all(finding.works for finding in findings if finding.needed)
    raise typer.Exit(DONE if usable else UNUSABLE)
