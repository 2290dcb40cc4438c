"""Measured traces against the reference, with traces made from other codes' motion and by hand."""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError
from tests.command_line import Command
from tests.conftest import STEEL

CHAIN = hc.Chain(16, **STEEL)
SCENE = hc.Scene(CHAIN, hc.Striker(0.5), wall=hc.Wall("same"))
GAUGES = (hc.Gauge(granule=6), hc.Gauge(granule=11), hc.Gauge(contact=17))


def noisy(measured: pd.DataFrame, noise: float, offset: float = 0.0) -> pd.DataFrame:
    """Traces with an offset and noise, as parts of their peaks."""
    traces = measured.copy()
    random = np.random.default_rng(7)
    for name in traces.columns[1:]:
        peak = traces[name].max()
        traces[name] += offset * peak + noise * peak * random.normal(size=len(traces))
    return traces


@pytest.fixture(scope="module")
def measured() -> pd.DataFrame:
    """Traces of LAMMPS's motion, on a clock that is late."""
    result = hc.Lammps(rtol=1e-4).run(replace(SCENE, gauges=GAUGES), record=1500)
    traces = result.to_traces()
    traces["time_s"] += 3.3e-4
    return traces


def failed(judgement: hc.TraceJudgement) -> set[str]:
    """The kinds of numbers that failed."""
    return {check.kind.name.split()[0] for check in judgement.checks if not check.passed}


def test_a_code_passes(measured: pd.DataFrame) -> None:
    """Its time of the start is found, and each number is nearer than a tenth of the tolerance."""
    judgement = hc.judge_traces(SCENE, measured, tolerance=1e-3)
    assert judgement, judgement
    assert judgement.shift == pytest.approx(3.3e-4, abs=1e-8)
    assert len(judgement.checks) == 2 * 3 + 2 + 3
    assert judgement.remarks == ()
    assert "granule 11" in repr(judgement)
    assert f"the run begins at {judgement.shift:.6g} s of the" in " ".join(repr(judgement).split())
    assert "Verdict: pass" in str(judgement)


@pytest.mark.parametrize(("noise", "offset"), [(3e-3, 0.05), (1e-2, -0.3)])
def test_noise_and_offset_do_not_matter(
    measured: pd.DataFrame, noise: float, offset: float
) -> None:
    judgement = hc.judge_traces(SCENE, noisy(measured, noise, offset), tolerance=0.05)
    assert judgement
    assert judgement.shift == pytest.approx(3.3e-4, abs=1e-6)
    assert len(judgement.numbers) == 2 * 3 + 2
    for number in judgement.numbers:
        off = abs(number.measured - number.simulated)
        assert off < 4 * number.deviation < 0.1 * number.simulated


def with_ripple(traces: pd.DataFrame, off: float, first: Any) -> None:
    """After the pulse, before the wave comes back from the wall."""
    time, peak = traces["time_s"], traces["gauge_6_N"].max()
    since = (time - 3.3e-4 - first.arrival) / first.width
    after = ((since > 2) & (since < 4)).to_numpy()
    size = off * np.sqrt(2 * len(time) / after.sum()) * peak
    traces["gauge_6_N"] += size * np.sin(2 * np.pi * time / 1.7e-5) * after


def with_gain(traces: pd.DataFrame, off: float, _: Any) -> None:
    traces["gauge_11_N"] *= 1 + off


def fast(traces: pd.DataFrame, off: float, _: Any) -> None:
    traces["time_s"] *= 1 + off


def late(traces: pd.DataFrame, off: float, first: Any) -> None:
    """By a part of the earliest arrival, which is a smaller part of the others."""
    traces["time_s"] += off * first.arrival - 3.3e-4


OFF: dict[str, tuple[Any, set[str]]] = {
    "a gain": (with_gain, {"first"}),
    "a clock that is fast": (fast, {"width", "time"}),
    "a clock that is known": (late, {"arrival"}),
    "what is not a pulse of the scene": (with_ripple, {"whole"}),
}
"""Changes of traces, and the kinds of numbers that fail then, besides whole traces."""


@pytest.mark.parametrize(("part", "fails"), [(3.0, True), (-3.0, True), (0.33, False)])
@pytest.mark.parametrize("what", OFF)
def test_both_sides_of_the_tolerance(
    measured: pd.DataFrame, what: str, part: float, fails: bool
) -> None:
    change, kinds = OFF[what]
    traces, first = measured.copy(), hc.judge_traces(SCENE, measured).expected.readings[0]
    change(traces, part * 0.02, first)
    judgement = hc.judge_traces(SCENE, traces, tolerance=0.02, shift=change is not late)
    assert failed(judgement) - ({"whole"} - kinds) == (kinds if fails else set())
    wrong = {check.engine for check in judgement.checks if not check.passed}
    assert change is not with_gain or wrong == ({"granule 11"} if fails else set())
    assert change is not late or judgement.shift == 0


def test_another_modulus() -> None:
    """The speed goes with E^0.4: 8 % of E are 3 % of the times."""
    other = replace(SCENE, chain=replace(CHAIN, young_modulus=1.08 * STEEL["young_modulus"]))
    traces = hc.Native(rtol=1e-8).run(replace(other, gauges=GAUGES), record=1500).to_traces()
    assert "time" in failed(hc.judge_traces(SCENE, traces, tolerance=1e-2))
    assert hc.judge_traces(other, traces, tolerance=1e-3)


def test_noise_that_hides_the_tolerance_is_said(measured: pd.DataFrame) -> None:
    judgement = hc.judge_traces(SCENE, noisy(measured, 0.03), tolerance=1e-3)
    assert any("hide the tolerance of 1.0e-03" in remark for remark in judgement.remarks)
    assert {check.kind.name.split()[0] for check in judgement.checks} == {"whole"}


def test_a_recording_that_ends_within_a_pulse(measured: pd.DataFrame) -> None:
    judgement = hc.judge_traces(SCENE, measured, tolerance=1e-3)
    end = judgement.shift + judgement.expected.readings[1].time
    before = measured[measured["time_s"] < end].drop(columns="wall_N")
    cut = hc.judge_traces(SCENE, before, tolerance=1e-3)
    assert cut
    assert {number.of for number in cut.numbers} == {"granule 6"}
    assert any("not whole" in remark for remark in cut.remarks)


def test_files_of_oscilloscopes(
    measured: pd.DataFrame, tmp_path: Path, hertzchain: Command
) -> None:
    """Semicolons, decimal commas, microseconds and volts; the command, its JSON and its status."""
    SCENE.to_toml(tmp_path / "scene.toml")
    lines = ["Time (us);CH1 (V);CH2 (V)"]
    for time, first, _, wall in measured.to_numpy():
        row = f"{1e6 * time:.9g};{first / 25:.9g};{wall / 50:.9g}"
        lines.append(row.replace(".", ","))
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(lines) + "\n")
    columns = ("--column", "gauge_6=CH1 [25 N]", "--column", "wall=CH2 [50 N]")
    done = hertzchain(
        "judge", tmp_path / "scene.toml", path, *columns, "--tolerance", "1e-3", "--json"
    )
    assert done.status == 0, done.err
    assert done.json()["verdict"] == "pass"
    assert len(done.json()["checks"]) == 2 * 2 + 1 + 2
    wrong = ("--column", "gauge_6=CH1 [24 N]", "--column", "wall=CH2 [50 N]")
    done = hertzchain("judge", tmp_path / "scene.toml", path, *wrong, "--tolerance", "1e-2")
    assert done.status == 1
    assert "granule 6: first peak [N]" in done.out


def test_a_file_for_each_channel(
    measured: pd.DataFrame, tmp_path: Path, hertzchain: Command
) -> None:
    """They are one record: times of travel are judged; names of columns tell them apart."""
    SCENE.to_toml(tmp_path / "scene.toml")
    channels = ("gauge_6_N", "gauge_11_N")
    paths = [tmp_path / f"{k}.csv" for k in range(2)]
    for path, channel in zip(paths, channels, strict=True):
        measured[["time_s", channel]].to_csv(path, index=False)
    done = hertzchain("judge", tmp_path / "scene.toml", *paths, "--json")
    assert done.status == 0, done.err
    alone = hc.judge_traces(SCENE, measured[["time_s", *channels]])
    assert [check["measured"] for check in done.json()["checks"]] == pytest.approx(
        [check.measured for check in alone.checks], rel=1e-12
    )
    assert done.json()["remarks"] == ["the files are of one record, on one clock"]
    for k, path in enumerate(paths):  # as Tektronix TDS names the channel
        _, first, *rows = path.read_text("utf-8").splitlines()
        lines = [f"Source,CH{k + 1},,{first}", *(f",,,{row}" for row in rows)]
        path.write_text("\n".join(lines), "utf-8")
    columns = {"gauge_6": "CH1", "gauge_11": "CH2"}
    assert len(hc.judge_traces(SCENE, paths, columns=columns).checks) == len(alone.checks)
    later = measured[["time_s", "wall_N"]].iloc[::2]
    for tables, words in (
        ([measured, later], "have a gauge twice: judge each record"),
        ([measured[["time_s", "gauge_6_N"]], later], "has other times than the table"),
        ([], "at least one file"),
    ):
        with pytest.raises(HertzchainError, match=words):
            hc.judge_traces(SCENE, tables)
    with pytest.raises(HertzchainError, match="--column CH9: no such column"):
        hc.judge_traces(SCENE, paths, columns=columns | {"wall": "CH9"})
    gauge, other = (measured[["time_s", name]] for name in channels)
    step = float(np.median(np.diff(measured["time_s"])))
    for share, is_one in ((0.003, True), (0.03, False)):
        moved = other.assign(time_s=other["time_s"] + share * step)
        with nullcontext() if is_one else pytest.raises(HertzchainError, match="other times"):
            assert hc.judge_traces(SCENE, [gauge, moved])
    # Cells that are empty in only one of the files are gaps of the record.
    gaps = other.assign(**{channels[1]: other[channels[1]].mask(other.index % 50 == 7)})
    gaps.to_csv(tmp_path / "gaps.csv", index=False)
    judged = hc.judge_traces(SCENE, [gauge, tmp_path / "gaps.csv"])
    assert judged.traces.time.size == len(other) - 30
    assert "; 30 samples that not all of them have are left out" in judged.remarks[0]
    gauge.to_csv(tmp_path / "gauge.csv", index=False)
    (tmp_path / "none.csv").write_text("a,b\n" + "1,2\n" * 9)
    for name, said in (("none.csv", "has no forces of gauges"), ("gone.csv", "cannot be read")):
        done = hertzchain("judge", tmp_path / "scene.toml", tmp_path / "gauge.csv", tmp_path / name)
        assert (done.status, said in done.err) == (2, True), done.err


def test_a_page_and_a_figure(measured: pd.DataFrame, tmp_path: Path) -> None:
    judgement = hc.judge_traces(SCENE, measured, tolerance=1e-3)
    judgement.report(tmp_path / "page.html")
    assert "Judgement of measured traces" in (tmp_path / "page.html").read_text()
    (axes,) = judgement.plot().axes
    time = measured["time_s"].to_numpy() - judgement.shift
    shown = (time >= 0) & (time <= judgement.expected.until)
    native = hc.Native("reference").run(replace(SCENE, gauges=GAUGES), record=time[shown])
    largest = native.to_traces().iloc[:, 1:].to_numpy().max()
    for k, name in enumerate(measured.columns[1:]):
        points, line = axes.lines[2 * k : 2 * k + 2]
        np.testing.assert_array_equal([points.get_xdata(), line.get_xdata()], [time[shown]] * 2)
        below = points.get_ydata() - measured[name].to_numpy()[shown]
        assert below == pytest.approx((2 - k) * 1.1 * largest, abs=1e-4 * largest)
        force = native.to_traces()[name].to_numpy()
        assert line.get_ydata() - below == pytest.approx(force, abs=1e-4 * largest)
    assert axes.get_ylim() == pytest.approx((-0.165 * largest, 3.3 * largest), rel=1e-3)
    header, *rows = (re.split(r"\s{2,}", row.strip()) for row in str(judgement).splitlines()[3:7])
    assert header == ["gauge", "measured", "native", "height", "width", "noise"]
    forces = [measured.iloc[:, 1:].max().tolist(), [gauge.force for gauge in native.gauges]]
    cells = np.array([row[1:3] for row in rows], np.float64)
    np.testing.assert_allclose(cells, np.array(forces, np.float64).T, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "columns", "words"),
    [
        ({"gauge_17_N": 1.0}, {}, "must be a granule from 2 to 16"),
        ({"contact_1_N": 1.0}, {}, "must be a contact from 2 to 17"),
        ({"near_wall_N": 1.0}, {}, r"without \[near_wall\]"),
        ({"gauge_6_N": 0.0}, {}, "is 0 throughout"),
        ({"gauge_6_N": np.nan}, {}, "has no finite time and force"),
        ({"time_s": 0.0}, {}, "the time is not above that of line 1"),
        ({"time_s": np.arange(1500.0)}, {}, "last far longer than the run: check the unit"),
        ({"time_s": 1e-12 * np.arange(1500)}, {}, "less than a first pulse: check the unit"),
        ({}, {"gauge_6": "CH1"}, "--column CH1: no such column"),
        ({}, {"bead_6": "gauge_6_N"}, "must be gauge_ and the number"),
        ({}, {"gauge_6": "gauge_6_N [5 m]"}, "gauge_6"),
    ],
)
def test_what_cannot_be_judged(
    measured: pd.DataFrame, change: dict[str, Any], columns: dict[str, str], words: str
) -> None:
    with pytest.raises(HertzchainError, match=words):
        hc.judge_traces(SCENE, measured.assign(**change), columns=columns)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read"),
        ("", "no line has numbers in two columns"),
        ("time_s,force\n0,1\n1,2\n", "name those of gauges"),
        ("time_s,gauge_6_N,gauge_6_kN\n" + "1,2,3\n" * 9, "have a gauge twice"),
        ("time_s,wall_N\n" + "1,2\n" * 9, r"without \[wall\]"),
    ],
)
def test_files_that_are_no_traces(content: str | None, words: str, tmp_path: Path) -> None:
    path = tmp_path / "traces.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(HertzchainError, match=words):
        hc.judge_traces(replace(SCENE, wall=None), path)


def test_noise_does_not_hide_what_is_clearly_off(measured: pd.DataFrame) -> None:
    """A gain of 1.3 with a noise that is more than the tolerance is not a pass."""
    traces = noisy(measured, 0.1)
    for name in traces.columns[1:]:
        traces[name] *= 1.3
    assert "first" in failed(hc.judge_traces(SCENE, traces, tolerance=0.05))


def test_a_recording_without_a_pulse_is_no_pass(measured: pd.DataFrame) -> None:
    early = measured[["time_s", "gauge_11_N"]].copy()
    early["time_s"] -= 3.3e-4
    early["gauge_11_N"] += 1e-3 * np.cos(np.arange(len(early)))
    judgement = hc.judge_traces(SCENE, early[early["time_s"] < 3e-5], tolerance=0.05, shift=False)
    assert not judgement
    assert judgement.checks == ()


def test_a_signal_that_goes_down(measured: pd.DataFrame) -> None:
    traces = measured.assign(gauge_6_N=-measured["gauge_6_N"])[["time_s", "gauge_6_N"]]
    with pytest.raises(HertzchainError, match="upside down: give a negative unit"):
        hc.judge_traces(SCENE, traces)
    assert hc.judge_traces(SCENE, traces, columns={"gauge_6": "gauge_6_N [-1 N]"})


@pytest.mark.parametrize(("digits", "clipped"), [(2, False), (2, True), (12, True)])
def test_clipped_recordings_are_named(measured: pd.DataFrame, digits: int, clipped: bool) -> None:
    """A crest that is flat by the digits of the recording is not clipped."""
    traces = measured[["time_s", "gauge_6_N"]].copy()
    force = traces["gauge_6_N"] / traces["gauge_6_N"].max()
    traces["gauge_6_N"] = 20 * (force.clip(upper=0.8) if clipped else force).round(digits)
    remarks = hc.judge_traces(SCENE, traces).remarks
    assert any("clipped recording" in remark for remark in remarks) == clipped


def test_a_gauge_that_is_unloaded_first_is_quiet_only_until_then() -> None:
    """Behind the pushed granule of a pressed chain; offset and noise are those before."""
    pulse = hc.Pulse("cosine-triangular", 10.0, 2.0, momentum_ratio=2.0, granule=5)
    gauges = hc.Gauge(granule=3), hc.Gauge(granule=8)
    scene = hc.Scene(
        hc.Chain(12, **STEEL), pulse, precompression=hc.Precompression(20.0), gauges=gauges
    )
    traces = hc.Native(rtol=1e-8).run(scene, record=2000).to_traces()
    assert hc.judge_traces(scene, traces)
