"""All commands, in the order of --help, and how a function becomes a command."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import is_dataclass
from functools import wraps
from inspect import Parameter, Signature, getdoc, signature
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from hertzchain.cli import decks, doctor, lab, options, run, sweep
from hertzchain.cli.output import Answer, Written, write_files

app = typer.Typer(
    name="hertzchain",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="How hard each contact of a shocked chain of spheres is pressed, and how sure that is.",
    epilog="Exit status: 0 done and within tolerance, 1 out of tolerance, 2 unusable input, a"
    " refusal or a missing backend, 130 interrupted, 143 terminated.",
)

OptionValue = Any
"""A value as Typer reads it."""

_NAMES = {
    "as_json": ["--json"],
    "every": ["--all"],
    "folder": ["-o", "--output"],
    "kind": ["--from"],
    "output": ["-o", "--output"],
    "realisations": ["-n", "--realisations"],
    "variables": ["--var"],
}
"""Options with other names than those of their parameters."""

_FILES = {"plot": "plot", "report": "page", "traces": "traces"} | dict.fromkeys(
    ("output", "fix", "junit"), ""
)
"""Options that name files to write, with their kind for ``check_format`` if it is always one."""


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hertzchain {version('hertzchain')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


def _command(answering: Callable[..., Answer | Sequence[Written] | None]) -> Callable[..., None]:
    """Return a command of a function.

    Its arguments are the positional parameters, its options those by keyword; a parameter that is a
    dataclass is a group of options, its fields. Their help is in the section ``Options`` of the
    docstrings, or that of ``options``. An answer can also be printed as JSON. Files that cannot be
    written are refused before the function is called.
    """
    hints = get_type_hints(answering)
    answer_type = hints.pop("return")
    said, texts = _help_of(answering)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters: list[Parameter] = []
    for name, parameter in signature(answering).parameters.items():
        if name not in groups:
            parameters.append(_option(parameter.replace(annotation=hints[name]), texts))
            continue
        types = get_type_hints(groups[name])
        of_group = {k: v for base in groups[name].__mro__ for k, v in _help_of(base)[1].items()}
        for field in signature(groups[name]).parameters.values():
            by_keyword = field.replace(kind=Parameter.KEYWORD_ONLY, annotation=types[field.name])
            parameters.append(_option(by_keyword, of_group))
    if answer_type is Answer:
        as_json = Parameter("as_json", Parameter.KEYWORD_ONLY, default=False, annotation=bool)
        parameters.append(_option(as_json, {}))
    files = [p.name for p in parameters if p.name in _FILES]

    @wraps(answering)
    def run(**given: OptionValue) -> None:
        _check_files(given, files)
        as_json = given.pop("as_json", False)
        for name, group in groups.items():
            given[name] = group(
                **{field: given.pop(field) for field in signature(group).parameters}
            )
        answer = answering(**given)
        if isinstance(answer, Answer):
            answer.give(as_json)
        write_files(answer or ())

    run.__doc__ = said
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in parameters}
    return run


def _help_of(documented: object) -> tuple[str, dict[str, tuple[str, str]]]:
    """Return a docstring without its options, and metavar and help of each of these."""
    said, _, section = (getdoc(documented) or "").partition("Options\n-------\n")
    entries = re.split(r"^(\w+)(?: ([^:\n]+))?: ", section, flags=re.MULTILINE)[1:]
    names, metavars, texts = entries[::3], entries[1::3], entries[2::3]
    return said.strip(), {
        name: (metavar, " ".join(text.split()))
        for name, metavar, text in zip(names, metavars, texts, strict=True)
    }


def _option(parameter: Parameter, texts: dict[str, tuple[str, str]]) -> Parameter:
    """Return a parameter as Typer reads it, with names, metavar and help."""
    name, is_option = parameter.name, parameter.kind is Parameter.KEYWORD_ONLY
    metavar, text = texts[name] if name in texts else _help_of(options)[1][name]
    about = (
        typer.Option(*_NAMES.get(name, [f"--{name}".replace("_", "-")]), metavar=metavar, help=text)
        if is_option
        else typer.Argument(metavar=metavar, help=text)
    )
    annotation = Annotated[parameter.annotation, about]  # type: ignore[name-defined]
    return parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=annotation)


def _check_files(given: dict[str, OptionValue], written: Sequence[str]) -> None:
    """Refuse files that cannot be written, or that are read, too."""
    from hertzchain.files import check_outputs
    from hertzchain.report.files import check_format

    read: list[Path] = []
    for name in given.keys() - {*written}:
        values = given[name] if isinstance(given[name], list) else [given[name]]
        read += [value for value in values if isinstance(value, Path)]
    check_outputs(read, [given[name] for name in written])
    for name in written:
        if _FILES[name]:
            check_format(given[name], _FILES[name])


# --help lists the commands in this order.
for function in (
    *(run.init, lab.pulse, run.run, run.compare, lab.judge, lab.fit, decks.examine, run.tradeoff),
    *(run.timestep, lab.spectrum, lab.spread, sweep.sweep, sweep.plot, run.predict, decks.deck),
    *(decks.lint, decks.unit_test, decks.certify, doctor.doctor),
):
    app.command()(_command(function))
