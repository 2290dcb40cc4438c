"""hertzchain init, predict, timestep and tradeoff: a scene without a verdict."""

from __future__ import annotations

import shlex
from enum import StrEnum
from pathlib import Path

import typer

from hertzchain.cli.options import AsJson, PictureOptions, SceneFile, load_scene
from hertzchain.cli.output import UNUSABLE, check_files, compiling, progress, say, show, write_file
from hertzchain.errors import OutputError
from hertzchain.files import check_outputs
from hertzchain.scene.starters import NAMES, files_of, title_of, write_starter

Kind = StrEnum("Kind", {name.upper(): name for name in NAMES})  # type: ignore[misc]
"""The scenes to start from, as choices of an option."""

PULSE = Kind("pulse")


def init(
    path: Path = typer.Argument(
        Path("scene.toml"), metavar="FILE", help="The scene file to write (TOML)."
    ),
    kind: Kind = typer.Option(PULSE, "--from", help="Kind of the scene."),
) -> None:
    """Write a commented scene file to start from.

    The command also says what to do next. "pulse-table" also writes a table next to it, to be
    replaced with a measured pulse.
    """
    files = files_of(kind.value, path)
    check_outputs([], files)
    if there := [file for file in files if file.exists()]:
        raise OutputError(f"{there[0]}: exists; name another file, or delete it")
    written = write_starter(kind.value, path)
    typer.echo(f"{' and '.join(map(str, written))}: {title_of(kind.value)}")
    typer.echo(f"Change it in an editor, then: hertzchain compare {shlex.quote(str(path))}")


def predict(scene: SceneFile, as_json: AsJson = False) -> None:
    """Predict peaks, p and F_SW without a simulation.

    They come from the formulas, a map of simulated peaks, and the exact solitary wave.
    """
    from hertzchain import theory
    from hertzchain.report.console import print_prediction

    prediction = theory.predict(load_scene(scene))
    show(as_json, prediction.to_dict, lambda console: print_prediction(console, prediction))


def timestep(
    scene: SceneFile, rtol: float = typer.Option(1e-3, help="Wanted relative error of the peaks.")
) -> None:
    """Find the longest time step of LAMMPS for a wanted accuracy.

    The step holds for any code that uses velocity Verlet.
    """
    from hertzchain.known.answer import deck_step

    loaded = load_scene(scene)
    with progress() as report_progress, compiling(report_progress):
        report_progress("trying steps")
        step = deck_step(loaded, rtol=rtol) * loaded.units.time
    typer.echo(
        f"timestep {step:.3g} s: peaks right to {rtol:g} in {loaded.end_time / step:.0f} steps"
    )


def tradeoff(scene: SceneFile, *, as_json: AsJson = False, picture: PictureOptions) -> None:
    """Measure error against cost of every method on a scene.

    This takes half a minute for 60 granules.
    """
    from hertzchain.report import figures
    from hertzchain.report.console import print_tradeoff
    from hertzchain.verdict.tradeoff import tradeoff as measure

    inches = picture.inches
    loaded = load_scene(scene)
    check_files([scene], plot=picture.plot)
    with progress() as report_progress, compiling(report_progress):
        measured = measure(loaded, progress=report_progress)
    show(as_json, measured.to_dict, lambda console: print_tradeoff(console, [measured]))
    for remark in measured.remarks:
        say(remark)
    write_file(
        "Plot", picture.plot, lambda path: figures.plot_tradeoff([measured], inches).write(path)
    )
    if measured.missing:
        raise typer.Exit(UNUSABLE)
