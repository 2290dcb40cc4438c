"""Contact force over time along the chain, in Plotly's format, and the times to record for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.facts import time_unit
from hertzchain.report.plotly import Plot, Trace, axis, layout
from hertzchain.report.style import COLOURS, DASHES, LABELS
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.scene import Scene

_TIMES = 500  # recorded times of a history
READINGS = 4_000_000  # times and granules recorded at once: 100 MB for each simulation

_EVEN, _DENSE, _BURST = 0.4, 0.25, 0.5
"""Intervals between recorded times [units of time of a contact]: the longest even one; the one
where the wave forms in a long chain; the one in later bursts.
"""

# recorded times of a burst; the wave passes a contact in six units of time, of these ten
_OF_A_BURST = 20
_OWN, _AROUND = 2.5, 8.0  # contacts' units of time around a peak: recorded closely at least; drawn
_CURVES = 20  # contacts in the plot of contact force over time


def record_times(scene: Scene) -> FloatArray:
    """Return increasing times at which to record a scene for a plot of its wave [s].

    They are even if about 500 follow the wave all the way. Otherwise they are close while the wave
    forms, and then in bursts, geometrically apart, in each of which it passes a few contacts.
    """
    count = int(np.clip(READINGS // scene.chain.granules, 2, _TIMES))
    unit = wave_time(scene)
    end = scene.end_time
    if end <= _EVEN * unit * (count - 1):
        return np.linspace(0.0, end, count)
    dense = _DENSE * unit * np.arange(count * 5 // 8)
    burst = _BURST * unit * np.arange(_OF_A_BURST)
    bursts = (count - dense.size) // _OF_A_BURST
    starts = np.geomspace(dense[-1] + burst[-1], end - burst[-1], bursts)
    times = np.concatenate([dense, (starts[:, None] + burst).ravel()])
    return np.unique(times[times <= end])


def wave_time(scene: Scene) -> float:
    """The unit of time of the contacts of a scene [s]: it goes as their force to the power -1/6."""
    return float(scene.units.time * force_scale(scene.momentum_ratio) ** (-1 / 6))


def _followed(result: Result) -> NDArray[np.int_]:
    """Return contacts whose peak lies well within closely recorded times."""
    assert result.history is not None
    time = result.history.time
    of_segment = np.concatenate([[0], np.cumsum(_gaps(time))])
    contact = result.contact[np.isfinite(result.peak_time)]
    peak_time = result.peak_time[contact - 2]
    before = np.clip(np.searchsorted(time, peak_time, "right") - 1, 0, time.size - 2)
    same = of_segment[before] == of_segment[before + 1]
    first = np.searchsorted(of_segment, of_segment[before], "left")
    last = np.searchsorted(of_segment, of_segment[before], "right") - 1
    from_start = np.where(time[first] > 0, peak_time - time[first], np.inf)
    to_end = np.where(last < time.size - 1, time[last] - peak_time, np.inf)
    close = np.minimum(from_start, to_end) > _OWN * wave_time(result.scene)
    return np.asarray(contact[same & close])


def _gaps(time: FloatArray) -> NDArray[np.bool_]:
    """Return the places where recorded times are too far apart to connect them."""
    steps = np.diff(time)
    return np.asarray(steps > 3 * np.min(steps))


def drawn_contacts(result: Result) -> list[int]:
    """Paper's numbers of the drawn contacts, which are closer together near the shock."""
    if result.history is None or result.history.time.size < 2:
        return []
    followed = _followed(result)
    if followed.size <= _CURVES:
        return [int(contact) for contact in followed]
    wanted = np.geomspace(followed[0], followed[-1], _CURVES)
    nearest = np.argmin(np.abs(np.log(followed[:, None] / wanted)), axis=0)
    return [int(contact) for contact in np.unique(followed[nearest])]


@dataclass(frozen=True)
class _Scale:
    """Scales of the plot of forces over time."""

    around: float  # time drawn around a peak [s]; if infinite, all from time 0
    unit: float  # unit of time [s]
    unit_name: str
    height: float  # height of a newton, in lines

    def trace(
        self, place: int, what: str, name: str, curve: tuple[FloatArray, FloatArray], peak: float
    ) -> Trace:
        """Line ``place`` from below, from labels, times [s], forces [N] and the peak time."""
        time, force = curve
        inside = np.abs(time - peak) <= self.around
        time, force = time[inside], force[inside]
        still = np.zeros(force.size, bool)  # points within a straight line are dropped
        still[1:-1] = (force[:-2] == 0) & (force[1:-1] == 0) & (force[2:] == 0)
        time, force = time[~still], force[~still]
        zero = peak if np.isfinite(self.around) else 0.0
        told = zip(time, force, strict=True)
        return {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": [_rounded((t - zero) / self.unit) for t in time],
            "y": [_rounded(place + self.height * f) for f in force],
            "customdata": [[_rounded(f, 9), _rounded(t / self.unit, 9)] for t, f in told],
            "hovertemplate": f"{what}, {name}<br>%{{customdata[1]:.6g}} {self.unit_name}"
            "<br>%{customdata[0]:.6g} N<extra></extra>",
        }


def why_no_waterfall(native: Result) -> str:
    """Return why ``waterfall`` has nothing to draw, if so, without a full stop."""
    if native.history is None:
        return (
            "no motion was recorded; hertzchain compare SCENE --report records what it runs itself"
        )
    return "no contact has its peak within closely recorded times"


def waterfall(results: Mapping[str, Result]) -> Plot | None:
    """Return a plot of contact forces over time, stacked by contact; None without a history."""
    native = results["native"]
    drawn, history = drawn_contacts(native), native.history
    if not drawn or history is None:
        return None
    scene = native.scene
    long = bool(np.any(_gaps(history.time)))
    # The waves of a long chain are as narrow as lines: each is drawn around its own peak.
    around = _AROUND * wave_time(scene) if long else np.inf
    unit_name, unit = time_unit(around if long else scene.end_time)
    largest = max(float(np.max(native.peak_force)), scene.peak_force)
    scale = _Scale(around, unit, unit_name, 1.6 / largest)
    traces, below = [], ""
    if scene.ramps:
        below = ", and the applied force below them"
        time = _shock_times(scene)
        shock = time, scene.applied_force(time)
        highest = float(time[np.argmax(shock[1])])
        grey = {"line": {"color": "#777", "width": 1.5}, "legendgroup": "shock"}
        traces = [scale.trace(0, "shock", "applied force", shock, highest) | grey]
    for key, result in results.items():
        if result.history is None:
            continue
        style: dict[str, Any] = {"color": COLOURS[key], "width": 1.5}
        if key != "native":
            style |= {"dash": DASHES[key], "width": 2.5}
        for place, contact in enumerate(drawn, start=1):
            curve, peak = with_peak(result, contact), float(native.peak_time[contact - 2])
            more = {"line": style, "legendgroup": key, "showlegend": place == 1}
            traces.append(
                scale.trace(place, scene.contact_name(contact), LABELS[key], curve, peak) | more
            )
    first = "striker" if scene.striker else "piston" if scene.piston else "shock"
    y = axis("contact", tickvals=list(range(len(drawn) + 1)))
    y |= {
        "ticktext": [first, *map(scene.contact_label, drawn)],
        "range": [-0.4, len(drawn) + 1.9],
    }
    if long:
        x = axis(f"time before and after its peak [{unit_name}]")
        x["range"] = [-around / unit, around / unit]
    else:
        x = axis(f"time [{unit_name}]", range=[0, scene.end_time / unit])
    own = " The chain is long: each line has its own zero of time, its peak." if long else ""
    return Plot(
        "waterfall",
        f"Contact force over time of {len(drawn)} contacts, one above the other: the wave runs from"
        f" the shocked end to the {'free end' if scene.wall is None else 'wall'}.",
        f"Contact force over time: a line for each of {len(drawn)} contacts, by their numbers"
        f"{below}; {largest:.4g} N are {scale.height * largest:.1f} lines high. Each line has its"
        f" exact peak.{own}",
        traces,
        layout(x, y, 260 + 22 * len(drawn)),
    )


def _shock_times(scene: Scene) -> FloatArray:
    """Times at which the applied force is drawn [s]: corners, times between them, end."""
    corners = [ramp.start for ramp in scene.ramps] + [scene.ramps[-1].end]
    even = np.linspace(corners[0], corners[-1], 200)
    if len(corners) > even.size:  # a table may have thousands of rows
        corners = [corners[0], corners[-1]]
    time = np.unique(np.concatenate([[0.0, scene.end_time], even, corners]))
    return time[time <= scene.end_time]


def with_peak(result: Result, contact: int) -> tuple[FloatArray, FloatArray]:
    """Times [s] and contact forces [N] of a contact, with its peak if it lies between them."""
    assert result.history is not None
    time, force = result.history.time, result.force_at(contact)
    peak_time = result.peak_time[contact - 2]
    if not time[0] < peak_time < time[-1] or peak_time in time:
        return time, force
    at = int(np.searchsorted(time, peak_time))
    return np.insert(time, at, peak_time), np.insert(force, at, result.peak_at(contact))


def _rounded(value: float, digits: int = 7) -> float:
    """Round values to the digits of a plot and its hover text, so that the page stays small."""
    return float(f"{value:.{digits}g}")
