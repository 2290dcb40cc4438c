"""What instruments add to forces, and what a fit that has it free finds again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.lab.model import drooped
from tests.lab.test_fit import FREE, START, TRUE, TRUTH, experiment, peaks_of

DRIFT, CONSTANT = 0.05, 4e-4  # parts of each peak over a record; time constant [s]


def shown(noise: float, seed: int = 0, **what: Any) -> tuple[pd.DataFrame, dict[str, float]]:
    """Traces as instruments show them, before the run, too, and what these made of the forces."""
    random = np.random.default_rng(seed)
    clean = hc.Native(rtol=1e-8).run(TRUE, record=1000).to_traces()
    step = float(clean["time_s"][1])
    time = step * np.arange(-400, 1000)
    truth: dict[str, float] = {}
    traces = pd.DataFrame({"time_s": time + 2e-4})
    for gauge, gain, sign in (("gauge_4", 1.0, 1), ("gauge_9", what.get("gain", 1.0), -1)):
        force = np.append(np.zeros(400), clean[f"{gauge}_N"])
        peak, length = float(force.max()), float(np.ptp(time))
        if gauge == "gauge_9" and "droop" in what:
            force = drooped(time.astype(np.float64), force, what["droop"])
        added = {
            "offset": 0.1 * sign * peak,
            "drift": what.get("drift", 0.0) * sign * peak / length,
        }
        clock = traces["time_s"]
        of_noise = noise * peak * random.normal(size=time.size)
        lines = added["offset"] + added["drift"] * clock
        traces[f"{gauge}_N"] = gain * force + lines + of_noise
        truth |= {f"{gauge}.{kind}": value for kind, value in added.items()}
    return traces, truth


def holds(fit: hc.Fit, truth: dict[str, float]) -> None:
    """Each value is less than four deviations off, and only noise is left."""
    every = {**dict(zip(FREE, TRUTH, strict=True)), **truth}
    assert fit.is_noise, fit
    for value in fit.parameters:
        assert abs(value.value - every[value.key]) < 4 * value.deviation, (value, every[value.key])


def test_gain_offset_and_drift() -> None:
    traces, truth = shown(0.01, gain=1.06, drift=DRIFT)
    added = [f"gauge_{k}.{kind}" for k in (4, 9) for kind in ("drift", "offset")]
    fit = hc.fit(START, traces, [*FREE, "gauge_9.gain", *added])
    holds(fit, truth | {"gauge_9.gain": 1.06})
    assert [value.key for value in fit.parameters] == [*FREE, "gauge_9.gain", *added]
    assert [value.unit for value in fit.parameters[3:6]] == ["", "N/s", "N"]
    assert {value.start for value in fit.parameters[4:]} == {0.0}
    np.testing.assert_allclose(np.diag(fit.correlation), 1.0)
    assert {entry.key for entry in fit.scene.uncertain} == set(FREE)
    # What is only read off changes no other value.
    alone = hc.fit(START, traces, [*FREE, "gauge_9.gain", "gauge_4.drift", "gauge_9.drift"])
    for value, other in zip(fit.parameters[:4], alone.parameters, strict=False):
        assert value.value == pytest.approx(other.value, rel=1e-6)


def test_droop() -> None:
    traces, truth = shown(0.01, seed=2, droop=CONSTANT)
    fit = hc.fit(START, traces, [*FREE, "gauge_9.droop=0.1 ms:10 ms"])
    holds(fit, truth | {"gauge_9.droop": CONSTANT})


def test_a_drift_of_each_record() -> None:
    """Two files of one gauge have clocks, offsets and drifts of their own, and one gain."""
    (first, truth), (two, _) = (shown(0.01, seed, gain=1.06, drift=DRIFT) for seed in (3, 4))
    fit = hc.fit(START, [first, two], [*FREE, "gauge_9.gain", "gauge_9.drift", "gauge_4.drift"])
    values = {value.key: value for value in fit.parameters}
    assert [*values][4:] == [f"gauge_{k}.drift[{n}]" for n in (1, 2) for k in (4, 9)]
    for key in [*values][4:]:
        off = values[key].value - truth[key.partition("[")[0]]
        assert abs(off) < 4 * values[key].deviation
    assert len(fit.shifts) == 2


@pytest.mark.usefixtures("few_starts")
def test_a_drift_gets_a_remark_that_says_how_to_free_it() -> None:
    traces, _ = shown(0.003, drift=DRIFT)
    fit, judged = hc.fit(START, traces, FREE), hc.judge_traces(TRUE, traces, tolerance=0.1)
    for remarks in (fit.remarks, judged.remarks):
        for gauge in ("gauge_4", "gauge_9"):
            assert any(f"fit --free {gauge}.drift" in remark for remark in remarks), remarks
    assert not any("drift" in remark for remark in hc.judge_traces(TRUE, shown(0.003)[0]).remarks)


def test_a_charge_amplifier_forgets_a_step_by_its_time_constant() -> None:
    """Its answer to a ramp of 1 N/s is tau (1 - exp(-t / tau)), also across a gap."""
    time = np.delete(np.linspace(0.0, 5.0, 501), slice(200, 240))
    expected = 2.0 * -np.expm1(-time / 2.0)
    np.testing.assert_allclose(drooped(time, time + 7.0, 2.0), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("free", "words"),
    [
        (["chain.young_modulus", "chain.density", "gauge_4.gain", "gauge_9.gain"],
         "cannot be told apart by these traces: a change of chain.young_modulus by"),
        (["gain", "gauge_4.gain", "gauge_9.gain"], "cannot be told apart"),
        (["striker.velocity", "gauge_5.drift"], "not measured: the traces have gauge_4, gauge_9"),
        (["striker.velocity", "wall.gain"], "is not a gauge of a scene without"),
        (["striker.velocity", "gauge_4.drift=1:2"], "has no range"),
        (["striker.velocity", "gauge_4.gain=2:1"], "must be the ends of its range"),
        (["striker.velocity", "gauge_4.gian"], "is not a key of a gauge: it has gain, droop"),
        (["striker.velocity", "gauge_4.drift[2]"], "is not a key of a gauge"),
        (["gauge_4.drift"], "must have a key of the scene, a gain or a droop, too"),
        (["striker.velocity", "gauge_4.drift", "gauge_4.drift"], "names a key twice"),
        (["chain.granules"], "must have a number other than 0"),
        (["chain.gap"], "must have a number other than 0"),
        (["wall.young_modulus"], "the scene has no"),
        ([], "must be a list of keys"),
        (["striker.velocity=1:2"], "is 0.5 m/s, must be within 1 and 2 m/s, to"),
        (["chain.young_modulus=180 GPa"], "must be the ends of its range"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_what_cannot_be_free(free: list[str], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        hc.fit(TRUE, experiment(0.01), free)
    assert words in str(caught.value), caught.value


def test_droop_needs_the_charge_at_the_start() -> None:
    traces, _ = shown(0.01)
    late = traces[traces["gauge_4_N"].idxmax() - 20 :]
    with pytest.raises(SceneError, match=r"gauge_4\.droop: needs samples before the pulse"):
        hc.fit(TRUE, late, ["striker.velocity", "gauge_4.droop"], clock="shared")
    with pytest.raises(SceneError, match=r"gauge_4\.gain: is of traces, and these are peaks"):
        hc.fit(TRUE, peaks_of(TRUE, 0.01), ["striker.velocity", "gauge_4.gain"])
    with pytest.raises(SceneError, match="clock = 'none': must be one of shared, own, run"):
        hc.fit(TRUE, traces, FREE, clock="none")


@pytest.mark.slow
def test_intervals_hold_the_truth_in_95_of_100_with_what_instruments_add() -> None:
    """20 experiments: 95 %, less three binomial deviations of 20 chains."""
    held = []
    for seed in range(20):
        traces, truth = shown(0.01, seed, gain=1.06, drift=DRIFT, droop=CONSTANT)
        of_gauges = [f"gauge_{k}.{kind}" for k in (4, 9) for kind in ("drift", "offset")]
        of_gauges += ["gauge_9.gain", "gauge_9.droop=0.1 ms:10 ms"]
        fit = hc.fit(START, traces, [*FREE, *of_gauges])
        assert fit.is_noise, seed
        truth |= {
            "gauge_9.gain": 1.06,
            "gauge_9.droop": CONSTANT,
            **dict(zip(FREE, TRUTH, strict=True)),
        }
        for value in fit.parameters:
            low, high = value.interval_95
            held.append(low < truth[value.key] < high)
    assert np.mean(held) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 20)
