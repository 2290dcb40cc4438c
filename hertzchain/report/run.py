"""The document of a run."""

from __future__ import annotations

import numpy as np

from hertzchain.observables.result import Result
from hertzchain.report.document import (
    Document,
    Peaks,
    Table,
    Verdict,
    cost,
    facts_of_terms,
    known_digits,
    number,
    shown_contacts,
    similar_scene,
    with_unit,
)
from hertzchain.report.files import run_document


def of_result(result: Result, pulses: bool = False) -> Document:
    """Return the document of a run, which has no verdict; with all pulses on request."""
    return Document(
        kind="Run",
        numbers=lambda: run_document(result, pulses),
        command="run",
        results={result.backend: result},
        verdict=Verdict(None, ""),
        peaks=_peaks(result),
        drawn={},
        limits=(),
        facts=_facts(result),
        remarks=result.warnings,
        pulses=_pulses(result) if pulses else None,
    )


def _peaks(result: Result) -> Peaks:
    """Return peaks with their known digits, and the other numbers of each contact."""
    static, first = result.static_force, result.first_pulses
    of_static = [] if static is None else [("static force", "[N]")]
    waits = ~result.peak_passed & result.is_reached
    of_first = [("first pulse", "[N]"), ("arrival", "[s]"), ("width", "[s]")]

    def row(k: int) -> list[str]:
        return [
            result.scene.contact_label(result.scene.contacts[k]),
            known_digits(result.peak_force[k], result.peak_errors[k]),
            *([] if static is None else [number(static[k], 7)]),
            number(result.peak_time[k], 6),
            *([] if first is None else _first_pulse(result, k)),
            "not peaked yet" if waits[k] else "",
        ]

    return Peaks(
        "Peak force of each contact",
        [
            ("contact", ""),
            ("peak force", "[N]"),
            *of_static,
            ("peak time", "[s]"),
            *([] if first is None else of_first),
            ("", ""),
        ],
        row,
        range(len(shown_contacts(result))),
    )


def _pulses(result: Result) -> Table:
    """Return all pulses with their known digits; a width is empty where it has no right one."""
    rows = [
        [
            train.gauge.place,
            number(pulse["time_s"], 6),
            known_digits(pulse["force_N"], pulse["force_error"]),
            number(pulse["arrival_time_s"], 6),
            number(pulse["width_s"], 6) if pulse["width_error_s"] < pulse["width_s"] else "",
        ]
        for train in result.trains
        for pulse in train.to_frame().to_dict("records")
    ]
    header = ("pulse of", "time [s]", "dynamic force [N]", "arrival [s]", "width [s]")
    return Table("All pulses, incident and reflected", header, rows)


def _facts(result: Result) -> list[tuple[str, str]]:
    """Return label and value of the facts of the whole run."""
    facts = [
        *main_facts(result),
        *_facts_of_collision(result),
        *_facts_of_wave(result),
        *_facts_of_gauges(result),
        ("error of the peaks, at most", f"{result.error_estimate:.1e}"),
        *_first_facts(result),
        ("largest overlap", f"{result.overlap_ratio:.2g} radii"),
        ("largest pressure", largest_pressure(result)),
        ("cost", cost(result)),
    ]
    if (similar := similar_scene(result)) is not None:
        facts.append(("computed as", similar))
    return facts


def largest_pressure(result: Result) -> str:
    """Return the largest pressure, where it is, and the strength below which a metal yields."""
    largest = result.largest_pressure
    if np.isnan(largest.pressure):
        return "not known: a measured stiffness does not tell it"
    if largest.time is None:
        return "0 Pa: no contact was pressed"
    return (
        f"{largest.pressure:.3g} Pa, {result.scene.contact_name(largest.contact)} at"
        f" {largest.time:.3g} s; metals of yield strength < {largest.needed_strength:.3g} Pa yield"
    )


def _first_pulse(result: Result, k: int) -> tuple[str, ...]:
    """Return force, arrival and width of the first pulse of a contact; empty where it has none."""
    columns = result.first_columns
    if np.isnan(columns["first_peak_force_N"][k]):
        return "", "", ""
    return (
        known_digits(columns["first_peak_force_N"][k], columns["first_peak_error"][k]),
        number(columns["arrival_time_s"][k], 6),
        number(columns["first_width_s"][k], 6),
    )


def _first_facts(result: Result) -> list[tuple[str, str]]:
    """Return the largest errors of first pulses; nothing if they were not wanted."""
    columns = result.first_columns
    if not columns or not np.isfinite(columns["first_peak_error"]).any():
        return []
    force, arrival = (np.nanmax(columns[key]) for key in ("first_peak_error", "arrival_error_s"))
    return [
        ("error of first pulses, at most", f"{force:.1e}"),
        ("error of arrivals, at most", with_unit(float(arrival), "s", 0.1)),
    ]


def _facts_of_collision(result: Result) -> list[tuple[str, str]]:
    """Return contact times with walls, and the momentum that came back; nothing without walls."""
    facts, columns, scene = [], result.first_columns, result.scene
    for section, k in ("near_wall", 0), ("wall", -1):
        if getattr(scene, section) is None or not columns:
            continue
        time, error = (columns[name][k] for name in ("contact_time_s", "contact_time_error_s"))
        if np.isfinite(time):
            name = section.replace("_", " ")
            facts.append((f"contact time with the {name}", with_unit(time, "s", error / time)))
    has_wall = scene.wall is not None or scene.near_wall is not None
    if has_wall and (restitution := result.restitution) is not None:
        parts = zip(("granule 1", "all granules"), restitution, strict=True)
        values = [f"{name} {value:.3g}" for name, value in parts if value is not None]
        facts += [("momentum back over momentum in", ", ".join(values))] if values else []
    return facts


def _facts_of_gauges(result: Result) -> list[tuple[str, str]]:
    """Return the first pulse of each gauge."""
    facts = []
    for read in result.gauges:
        said = "no first pulse that is known to its end"
        if np.isfinite(read.force):
            force = with_unit(read.force, "N", read.force_error)
            arrival = with_unit(read.arrival, "s", read.arrival_error / read.arrival)
            width = with_unit(read.width, "s", read.width_error / read.width)
            said = f"{force}, arrival {arrival}, width {width}"
            if np.isfinite(read.speed):
                speed = with_unit(read.speed, "m/s", read.speed_error)
                said += f", {speed} from the gauge before"
            elif read.speed_reason:
                said += f", {read.speed_reason}"
        facts.append((f"gauge, {read.gauge.key} {read.gauge.number}", said))
    return facts


def _facts_of_wave(result: Result) -> list[tuple[str, str]]:
    """Return speed, height and width of the wave by first pulses; nothing where there is none."""
    wave = result.usual_wave
    if wave is None:
        return []
    height = with_unit(wave.height, "N", wave.height_error)
    width = with_unit(wave.width, "s", wave.width_error)
    if np.isfinite(wave.width) and "unlike granules" not in result.scene.terms:
        width += f", {wave.width_granules:.3g} granules"
    return [
        (
            f"speed, contacts {wave.first} to {wave.last}",
            with_unit(wave.speed, "m/s", wave.speed_error),
        ),
        (f"height and width, contact {wave.last}", f"{height}, {width}"),
    ]


def main_facts(result: Result) -> list[tuple[str, str]]:
    """Return the main facts of a run besides peaks: the wave, or with terms the chain's ends."""
    return _wave_facts(result) if result.scene.is_plain else facts_of_terms(result)


def _wave_facts(result: Result) -> list[tuple[str, str]]:
    """Return the facts of a plain scene: the transition and the wave after it."""
    wave, p, estimate = result.solitary_wave, result.transition_granules, result.error_estimate
    return [
        ("transition, p", "none ends here" if p is None else f"{p} granules"),
        ("solitary wave, F_SW", with_unit(wave.peak_force, "N", estimate)),
        ("far-field force", _settled(wave.far_field_force, "N", wave.far_field_error, estimate)),
        ("speed", _settled(wave.speed, "m/s", wave.speed_error, estimate)),
    ]


def _settled(value: float | None, unit: str, error: float | None, estimate: float) -> str:
    """Return words for a number of the wave, and its largest difference from the settled wave."""
    if error is None:
        return with_unit(value, unit, estimate)
    if value is None:
        return f"not reached: the wave may change by {error:.0%} in a longer chain"
    return f"{with_unit(value, unit, max(estimate, error))}, settled to {error:.1e}"
