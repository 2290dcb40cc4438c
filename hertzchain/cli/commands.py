"""All commands, in the order of --help."""

from __future__ import annotations

from typing import Annotated

import typer

from hertzchain.cli.decks import certify, deck, examine, lint, unit_test
from hertzchain.cli.doctor import doctor
from hertzchain.cli.lab import fit, judge, pulse, spectrum, spread
from hertzchain.cli.options import with_groups
from hertzchain.cli.run import compare, run
from hertzchain.cli.scenes import init, predict, timestep, tradeoff
from hertzchain.cli.sweep import plot, sweep

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


# A command is a function with options; --help lists them in this order.
for command in (
    *(init, pulse, run, compare, judge, fit, examine, tradeoff, timestep, spectrum, spread),
    *(sweep, plot, predict, deck, lint, unit_test, certify, doctor),
):
    app.command()(with_groups(command))
