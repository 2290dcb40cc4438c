"""hertzchain timestep: the step for a wanted accuracy."""

from __future__ import annotations

import typer

from hertzchain.cli.options import SceneFile, load_scene
from hertzchain.cli.output import compiling, progress


def timestep(
    scene: SceneFile,
    rtol: float = typer.Option(1e-3, help="Wanted relative error of the peaks."),
) -> None:
    """Find the longest time step of LAMMPS for a wanted accuracy.

    The step is that of any velocity Verlet.
    """
    from hertzchain.known.answer import deck_step

    loaded = load_scene(scene)
    with progress() as report_progress, compiling(report_progress):
        report_progress("trying steps")
        step = deck_step(loaded, rtol=rtol) * loaded.units.time
    typer.echo(
        f"timestep {step:.3g} s: peaks right to {rtol:g} in {loaded.end_time / step:.0f} steps"
    )
