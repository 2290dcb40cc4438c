"""All commands, in the order of --help, and how a function becomes a command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from hertzchain.cli import decks, doctor, lab, run, sweep
from hertzchain.cli.options import FileKind
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


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hertzchain {version('hertzchain')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


_AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def _command(answering: Callable[..., Answer | Sequence[Written] | None]) -> Callable[..., None]:
    """Return a command of a function: its options, those of its groups, and its answer.

    A parameter that is a dataclass is a group: its fields are options. An answer can be printed as
    JSON. Files that cannot be written are refused before the function is called.
    """
    hints = get_type_hints(answering, include_extras=True)
    answer_type = hints.pop("return")
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    names = {name: [f.name for f in fields(group) if f.init] for name, group in groups.items()}
    parameters = []
    for name, parameter in signature(answering).parameters.items():
        options = [parameter.replace(annotation=hints[name])]
        if name in groups:
            of_fields = get_type_hints(groups[name], include_extras=True)
            options = [
                Parameter(
                    field.name, Parameter.KEYWORD_ONLY, default=field.default,
                    annotation=of_fields[field.name],
                )
                for field in fields(groups[name]) if field.init
            ]  # fmt: skip
        parameters += [option.replace(kind=Parameter.KEYWORD_ONLY) for option in options]
    if answer_type is Answer:
        by_name_only = Parameter.KEYWORD_ONLY
        parameters.append(Parameter("as_json", by_name_only, default=False, annotation=_AsJson))
    kinds = {  # of files to write, by their options
        option.name: mark.kind
        for option in parameters
        for mark in getattr(option.annotation, "__metadata__", ())
        if isinstance(mark, FileKind)
    }

    @wraps(answering)
    def run(**given: OptionValue) -> None:
        _check_files(given, kinds)
        as_json = given.pop("as_json", False)
        for name, group in groups.items():
            given[name] = group(**{option: given.pop(option) for option in names[name]})
        answer = answering(**given)
        if isinstance(answer, Answer):
            answer.give(as_json)
        write_files(answer or ())

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in parameters}
    return run


def _check_files(given: dict[str, OptionValue], kinds: dict[str, str]) -> None:
    """Refuse files that cannot be written, or that are read, too."""
    from hertzchain.files import check_outputs
    from hertzchain.report.files import check_format

    read: list[Path] = []
    for name in given.keys() - kinds:
        values = given[name] if isinstance(given[name], list) else [given[name]]
        read += [value for value in values if isinstance(value, Path)]
    check_outputs(read, [given[name] for name in kinds])
    for name, kind in kinds.items():
        if kind:
            check_format(given[name], kind)


# --help lists the commands in this order.
for function in (
    *(run.init, lab.pulse, run.run, run.compare, lab.judge, lab.fit, decks.examine, run.tradeoff),
    *(run.timestep, lab.spectrum, lab.spread, sweep.sweep, sweep.plot, run.predict, decks.deck),
    *(decks.lint, decks.unit_test, decks.certify, doctor.doctor),
):
    app.command()(_command(function))
