"""A run as a film: the chain with its contact forces, as it moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError
from hertzchain.files import write_with
from hertzchain.observables.result import Result
from hertzchain.report import style
from hertzchain.report.facts import describe, time_unit
from hertzchain.report.motion import motion_arrays, recorded

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.animation import AbstractMovieWriter
    from matplotlib.figure import Figure

FRAMES = 150  # of a film by default: six seconds
_RATE = 25  # frames per second
_LARGEST = 0.25  # overlap that is drawn for the largest one [radii]; chosen: seen at a glance
_FARTHEST = 0.06  # displacement that is drawn for the largest one [lengths of the chain]; chosen
_DOTS = 100  # per inch


def check_film_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a film that cannot be written here."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".gif", ".mp4"):
        raise OutputError(f"{path}: a film's name must end in .gif or .mp4")
    if suffix == ".mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise OutputError(
                f"{path}: an .mp4 needs the program ffmpeg, which is not on PATH: install it, or"
                " write a .gif"
            )


def write_film(result: Result, path: Path | str) -> None:
    """Write a film with a frame for each recorded time, whole or not at all."""
    check_film_format(path)

    def write(part: Path) -> None:
        figure, show = film(result)
        writer = _writer(part)
        with writer.saving(figure, str(part), _DOTS):
            for frame in range(recorded(result).time.size):
                show(frame)
                writer.grab_frame()

    write_with(path, write)


def _writer(path: Path) -> AbstractMovieWriter:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    kind = PillowWriter if path.suffix.lower() == ".gif" else FFMpegWriter
    return kind(fps=_RATE)


def film(result: Result) -> tuple[Figure, Callable[[int], None]]:
    """The figure of a film, and what shows a frame in it.

    Above are the granules, displaced by more than they are so that overlaps can be seen, and in
    the colour of the largest force on them; below the contact forces, and the peaks they reach.
    """
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle
    from matplotlib.ticker import MaxNLocator

    motion = motion_arrays(result)
    force, displacement = motion["contact_force_N"], recorded(result).displacement
    scene, radius = result.scene, result.scene.granules.radius
    count = scene.chain.granules
    sites = 2 * scene.chain.radius * np.arange(count) if scene.is_plain else scene.granules.position
    enlarged = _enlargement(result, sites)
    largest = float(max(np.max(result.all_peaks), np.max(force))) or 1.0  # N, if nothing is pressed

    figure = Figure(figsize=(9, 3.6), layout="constrained", dpi=_DOTS)
    chain, along = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2.6))
    figure.suptitle(describe(result.scene), fontsize=10)
    granules = PatchCollection([], cmap=style.force_colours(), edgecolor="0.3", linewidth=0.4)
    granules.set_clim(0, largest)
    chain.add_collection(granules)
    widest, moved = float(np.max(radius)), sites + enlarged * displacement
    chain.set_xlim(float(np.min(moved)) - 1.5 * widest, float(np.max(moved)) + 1.5 * widest)
    chain.set_axis_off()
    clock = chain.set_title("", fontsize=9, loc="left")
    factor = f"{enlarged:,.0f}" if enlarged < 1e7 else f"{enlarged:.0e}"
    chain.set_title(f"displacements enlarged {factor} times", fontsize=8, loc="right")

    place = (sites + radius)[: force.shape[1] - 1]  # of contacts at rest, above one another
    along.plot(place, result.all_peaks, color="0.6", linewidth=0.9, label="peak of the run")
    (line,) = along.plot(
        place, force[0, 1:], color=style.COLOURS[result.backend], linewidth=1.4, label="now"
    )
    along.set(xlabel="contact", ylabel="contact force [N]", ylim=(0, 1.3 * largest))
    contacts = MaxNLocator(10, integer=True).tick_values(2, place.size + 1)
    shown = [int(one) for one in contacts if 2 <= one <= place.size + 1]
    along.set_xticks([place[one - 2] for one in shown], [str(one) for one in shown])
    along.legend(fontsize=8, loc="upper right", ncols=2, frameon=False)
    along.grid(alpha=0.25)
    figure.colorbar(granules, ax=[chain, along], label="largest force on a granule [N]")
    name, unit = time_unit(result.scene.end_time)

    def show(frame: int) -> None:
        now = force[frame]
        behind = now[1 : count + 1] if now.size > count else np.append(now[1:], 0.0)
        circles = [
            Circle((x, 0.0), r)
            for x, r in zip(sites + enlarged * displacement[frame], radius, strict=True)
        ]
        granules.set_paths(circles)
        granules.set_array(np.maximum(now[:count], behind))
        line.set_ydata(now[1:])
        clock.set_text(f"{recorded(result).time[frame] / unit:.4g} {name}")

    show(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once: that takes longer than a frame
    box, (left, right) = chain.get_window_extent(), chain.get_xlim()
    half = (right - left) * box.height / box.width / 2  # granules are round
    chain.set_ylim(-half, half)
    return figure, show


def _enlargement(result: Result, sites: FloatArray) -> float:
    """How many times displacements are enlarged: the largest overlap is seen, no granule gets lost.

    A power of ten times 1, 2 or 5, which people divide by with ease.
    """
    overlap = _LARGEST / max(result.overlap_ratio, np.finfo(float).tiny)
    farthest = float(np.max(np.abs(recorded(result).displacement)))
    if farthest == 0:  # nothing has moved yet
        return 1.0
    most = min(overlap, _FARTHEST * float(sites[-1] - sites[0]) / max(farthest, 1e-300))
    if most <= 1:
        return 1.0
    power = 10.0 ** np.floor(np.log10(most))
    return float(power * max(step for step in (1, 2, 5) if step * power <= most))
