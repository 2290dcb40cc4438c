"""Certificates as text for a terminal, and as JUnit."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from hertzchain.known.certificate import WRONG, Certificate, Row
from hertzchain.report.console import print_prose, table
from hertzchain.report.junit import ERROR, FAILURE, SKIPPED, Case, Suite

if TYPE_CHECKING:
    from rich.console import Console

_LEFT = ("row", "tests", "grade")


def print_certificates(console: Console, certificates: Sequence[Certificate]) -> None:
    """Print a table for each program, with reasons below it, and one line on each at the end."""
    for certificate in certificates:
        rows = [_cells(row) for row in certificate.rows]
        could_run = not all(row.failed for row in certificate.rows)
        if could_run:
            console.print(table((*_LEFT, "difference", "by steps"), rows, _LEFT))
        for reason, names in _reasons(certificate).items():
            print_prose(console, f"{', '.join(names)}: {reason}" if could_run else reason)
        console.print()
    for certificate in certificates:
        console.print(certificate.sentence, soft_wrap=True)  # one line, for programs that read it


def suite(certificate: Certificate, begun: datetime) -> Suite:
    """Return the rows as test cases; those that could not be tested by choice are skipped."""
    cases = []
    for row in certificate.rows:
        if row.passed:
            cases.append(Case(row.case.name))
            continue
        problem = FAILURE if row.grade == WRONG else ERROR if row.failed else SKIPPED
        cases.append(Case(row.case.name, problem, f"{row.words}: {row.reason}", row.case.tests))
    program = certificate.program.replace(".", "_")
    name = f"hertzchain.certify.{program}"
    return Suite(name, tuple(cases), begun, certificate.seconds)


def _cells(row: Row) -> tuple[str, ...]:
    numbers = (row.difference, row.allowed)
    shown = ("" if number is None else f"{number:.1e}" for number in numbers)
    return (row.case.name, row.case.tests, row.words, *shown)


def _reasons(certificate: Certificate) -> dict[str, list[str]]:
    """Return the names of rows by the reason that they share."""
    found: dict[str, list[str]] = {}
    for row in certificate.rows:
        if row.reason:
            found.setdefault(row.reason, []).append(row.case.name)
    return found
