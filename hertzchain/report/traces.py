"""The document of a judgement of measured traces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hertzchain.report.document import Document, Overlay, Peaks, Verdict
from hertzchain.report.facts import failure_of, number

if TYPE_CHECKING:
    from hertzchain.verdict.traces.judging import TraceJudgement


def of_traces(judgement: TraceJudgement) -> Document:
    """Return the document of a judgement of measured forces over time."""
    checks, tolerance = judgement.checks, judgement.tolerance
    failed = [check for check in checks if not check.passed]
    if not checks:
        sentence = "Nothing could be judged."
    elif failed:
        sentence = f"{len(failed)} of {len(checks)} numbers are off by more than {tolerance:.1e}."
    else:
        sentence = f"All {len(checks)} numbers are within {tolerance:.1e} and their noise."
    return Document(
        kind="Judgement of measured traces",
        numbers=judgement.to_dict,
        command="judge",
        results={"native": judgement.reference},
        verdict=Verdict(
            judgement.verdict == "pass",
            sentence,
            [failure_of(check) for check in failed],
            [*judgement.remarks, *judgement.reference.warnings],
        ),
        peaks=_pulses(judgement),
        drawn={},
        limits=[],
        checks=checks,
        overlays=_overlays(judgement),
        facts=[
            ("the run begins at", f"{judgement.shift:.6g} s of the measured clock"),
            ("the reference is known until", f"{judgement.known.until:.3g} s of the run"),
            ("tolerance", f"{tolerance:.1e}, and the noise"),
        ],
        remarks=judgement.remarks,
    )  # fmt: skip


def _overlays(judgement: TraceJudgement) -> list[Overlay]:
    """Return the traces with the reference, while it is known."""
    known, traces = judgement.known, judgement.traces
    time = traces.time - judgement.shift
    during = (time >= 0) & (time <= known.until)
    return [
        Overlay(
            gauge.place, time[during], traces.force[during, k],
            known.at(k, time[during]),
        )
        for k, gauge in enumerate(traces.gauges)
    ]  # fmt: skip


def _pulses(judgement: TraceJudgement) -> Peaks:
    """Return the first pulse of each gauge next to that of the reference."""
    readings, noise = judgement.known.readings, judgement.traces.noise
    numbers = {(one.of, one.kind.name.split()[0]): one for one in judgement.numbers}

    def row(k: int) -> list[str]:
        read, of = readings[k], readings[k].gauge.place
        scatter = f"{noise[k] / read.force:.1e}" if read.force > 0 else ""
        if (of, "first") not in numbers:
            return [of, "", "", "", "", scatter]
        height, width = numbers[of, "first"], numbers[of, "width"]
        off = (f"{one.measured / one.simulated - 1:+.1e}" for one in (height, width))
        return [of, number(height.measured, 6), number(height.simulated, 6), *off, scatter]

    return Peaks(
        "First pulse of each gauge [N]: as measured, and by the reference method",
        [
            ("gauge", ""), ("measured", "[N]"), ("native", "[N]"), ("height", ""), ("width", ""),
            ("noise", ""),
        ],
        row,
        range(len(readings)),
        of_contacts=False,
    )  # fmt: skip
