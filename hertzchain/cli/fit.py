"""hertzchain fit: values of a scene that reproduce measured forces."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli import options
from hertzchain.cli.output import (
    OUT_OF_TOLERANCE,
    check_files,
    compiling,
    progress,
    show,
    write_file,
)

_TIE = "chain.granules='0.2 / (2 * chain.radius)'"


def fit(
    scene: options.SceneFile,
    traces: list[Path] = typer.Argument(
        ...,
        metavar="FILE",
        help="Forces over time, as for judge: time_s, gauge_16_N, contact_10_N, wall_N,"
        " near_wall_N, or any with --column; or peaks: contact, peak_force_N; several files are"
        " fitted at once.",
    ),
    free: list[str] = typer.Option(
        ...,
        metavar="KEY",
        help="A key of the scene to be fitted, such as chain.young_modulus, with a range where"
        " wanted, KEY=LOW:HIGH; repeatable. gain: the ratio of measured to true forces, the same"
        " for all gauges.",
    ),
    tie: list[str] | None = typer.Option(
        None,
        metavar="KEY=FORMULA",
        help="A key that follows from others by a formula of their full names, in SI units;"
        f" repeatable. A fixed length: {_TIE}.",
    ),
    column: list[str] | None = typer.Option(
        None,
        metavar="WHAT=NAME",
        help="Which column is what, and its unit; repeatable: time=Time,"
        " 'gauge_16=CH1 [25 N]', contact_10=CH2, wall=CH3.",
    ),
    no_shift: bool = typer.Option(
        False, "--no-shift", help="The clock of the files is that of the run."
    ),
    output: Path | None = typer.Option(
        None, "-o", "--output", metavar="FILE", help="Write the fitted scene (.toml)."
    ),
    time_limit: options.TimeLimit = "1 h",
    as_json: options.AsJson = False,
) -> None:
    """Fit values of a scene to measured forces or peaks.

    Values have 95 % intervals. The search starts from the values in the scene file. The status is
    1 if the residual is more than noise.
    """
    from hertzchain.fits import fit as fits

    check_files([scene, *traces], [output])
    columns = options.by_name("--column", column or [], "gauge_16=CH1")
    limit = options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    ties = options.by_name("--tie", tie or [], _TIE)
    with progress() as report_progress, compiling(report_progress):
        found = fits.fit(
            loaded, traces, free, ties=ties, columns=columns, shift=not no_shift,
            time_limit=limit, progress=report_progress,
        )  # fmt: skip
    show(as_json, found.to_dict, lambda console: console.print(repr(found)))
    write_file("Scene", output, found.scene.to_toml)
    if not found.is_noise:
        raise typer.Exit(OUT_OF_TOLERANCE)
