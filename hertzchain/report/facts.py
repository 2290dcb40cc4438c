"""Numbers and facts as every report shows them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.observables.result import Result

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement


def judgement_facts(judgement: Judgement) -> list[tuple[str, str]]:
    """Label and value of what a judgement says of all contacts together."""
    reference = judgement.reference
    failed = int(np.count_nonzero(judgement.judged & ~judgement.passed))
    judged = int(np.count_nonzero(judgement.judged))
    weak = reference.contact.size - judgement.missing - judged
    counts = [f"{judged} judged", f"{failed} failed", f"{judgement.missing} not given"]
    if weak:
        counts.append(f"{weak} below a thousandth of the largest, not judged")
    largest = judgement.largest_difference
    facts = [
        ("contacts", ", ".join(counts)),
        ("largest difference", "" if largest is None else f"{largest:.1e}"),
        ("tolerance", f"{judgement.tolerance:.1e}"),
        ("error of native, at most", f"{reference.error_estimate:.1e}"),
    ]
    if judgement.expected is not None:
        expected = judgement.expected
        off = (
            f"{expected.interpolated:.1e} off; {expected.sampled:.1e} if only samples are looked at"
        )
        facts.append((f"velocity Verlet, steps of {expected.dt:.3g} s", off))
    if judgement.like_steps is not None:
        interpolated, sampled = judgement.like_steps
        steps = f"with steps of {interpolated:.2g} s; {sampled:.2g} s if only samples are looked at"
        facts.append(("as far off: velocity Verlet", steps))
    return facts


def answers(comparison: Comparison) -> list[tuple[str, list[str]]]:
    """What each oracle says of the transition and the wave that leaves it.

    Returns
    -------
    Label and values, by the names in ``comparison.wanted`` and then of the formulas; empty where
    there is none.
    """
    formulas = comparison.formulas
    simulated = [comparison.results.get(name) for name in comparison.wanted]

    def row(
        label: str, shown: Callable[[Result], str], of_formulas: str = ""
    ) -> tuple[str, list[str]]:
        cells = ["" if result is None else shown(result) for result in simulated]
        return label, [*cells, of_formulas]

    def granules(result: Result) -> str:
        p = result.transition_granules
        return "none" if p is None else str(p)

    eq3 = formulas.transition_granules
    speed = f"{formulas.speed:.2f}, exact {formulas.exact_speed:.2f}" if formulas.speed else ""
    return [
        row("p, granules", granules, "" if eq3 is None else f"{eq3:.2f}"),
        row("F_SW [N]", lambda result: number(result.solitary_wave.peak_force, 8)),
        row("far-field force [N]", lambda result: number(result.solitary_wave.far_field_force, 8)),
        row(
            "speed [m/s]",
            lambda result: number(result.solitary_wave.speed, 7),
            speed and f"{speed} at F_SW",
        ),
    ]


def shown_contacts(result: Result) -> list[int]:
    """The transition up to contact p + 1; without p the first few contacts."""
    p = result.transition_granules
    last = 11 if p is None else p + 1
    return [int(contact) for contact in result.contact if contact <= last]


def cost(result: Result) -> str:
    """Wall time and steps of a run."""
    return (
        f"{result.wall_time:.2f} s, {result.steps:,} steps of at most {result.dt:.3g} s"
        f" ({result.backend}, {result.method})"
    )


def similar_scene(result: Result) -> str | None:
    """What a code was given instead of the scene, so that coordinates cost few digits."""
    lost = result.lost_digits
    if lost is None or lost.young_modulus == result.scene.chain.young_modulus:
        return None
    return (
        f"a similar chain of E = {lost.young_modulus:.3g} Pa, as absolute coordinates would cost"
        f" the peaks some {lost.predicted:.0e}; now {lost.bound:.0e} at most"
    )


def number(value: float | None, digits: int) -> str:
    """A number with so many significant digits; empty where there is none."""
    return "" if value is None or np.isnan(value) else f"{value:#.{digits}g}"


def with_unit(value: float | None, unit: str) -> str:
    """A number with its unit, or why there is none."""
    return "unknown: the chain or the run is too short" if value is None else f"{value:.7g} {unit}"


def difference(check: Check) -> tuple[str, str]:
    """How far off a check is, and its tolerance; empty where nothing was measured."""
    if check.measured is None or check.expected is None or check.tolerance is None:
        return "", ""
    return f"{abs(check.measured - check.expected):.1e}", f"{check.tolerance:.1e}"
