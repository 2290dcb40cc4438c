"""hertzchain fit: values of a scene that reproduce measured forces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
from hertzchain.errors import HertzchainError


def fit(
    scene: options.SceneFile,
    traces: list[Path] | None = typer.Argument(
        None,
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
    tie: options.Ties = None,
    minimise: str | None = typer.Option(
        None,
        metavar="NUMBER",
        help="Without files: change the keys within their ranges until this number of the result"
        " is least, such as wall_peak_force_N, gauge_1_arrival_time_s, gauge_1_width_s.",
    ),
    maximise: str | None = typer.Option(
        None, metavar="NUMBER", help="The same, until it is largest, such as speed_m_s."
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

    Values have 95 % intervals. With --minimise or --maximise the command finds the values of an
    optimum instead. The search starts from the values in the scene file. The status is 1 if the
    residual is more than noise.
    """
    from hertzchain.fits import fit as fits
    from hertzchain.fits.optimum import optimum

    files = traces or []
    check_files([scene, *files], [output])
    wanted = [one for one in (minimise, maximise) if one is not None]
    if len(wanted) + bool(files) != 1:
        raise HertzchainError(
            "fit takes files that were measured, or --minimise NUMBER, or --maximise NUMBER: give"
            " one of these"
        )
    options.refuse_without_need(bool(files), no_shift=no_shift, column=bool(column))
    columns = options.by_name("--column", column or [], "gauge_16=CH1")
    limit = options.to_time_limit(time_limit)
    loaded = options.load_scene(scene)
    ties = options.by_name("--tie", tie or [], options.TIE)
    with progress() as report_progress, compiling(report_progress):
        how: Any = {"ties": ties, "time_limit": limit, "progress": report_progress}
        if wanted:
            best = optimum(loaded, wanted[0], free, largest=maximise is not None, **how)
            show(as_json, best.to_dict, lambda console: console.print(repr(best)))
            write_file("Scene", output, best.scene.to_toml)
            return
        found = fits.fit(loaded, files, free, columns=columns, shift=not no_shift, **how)
    show(as_json, found.to_dict, lambda console: console.print(repr(found)))
    write_file("Scene", output, found.scene.to_toml)
    if not found.is_noise:
        raise typer.Exit(OUT_OF_TOLERANCE)
