"""Measured traces against uncertain scenes: three uncertainties, and what could have been seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.scene.uncertain import Uncertain
from hertzchain.uncertainty.document import of_validation
from hertzchain.uncertainty.validation import Compared
from hertzchain.verdict.traces.judging import PEAK, Number
from tests.command_line import Command
from tests.conftest import STEEL

GAUGES = (hc.Gauge(granule=4), hc.Gauge(granule=8))
TRUE = hc.Scene(hc.Chain(10, **STEEL), hc.Striker(0.5), gauges=GAUGES)
KEY = "chain.young_modulus"


def believed(modulus: float, known_to: float) -> hc.Scene:
    chain = hc.Chain(10, **{**STEEL, "young_modulus": modulus * STEEL["young_modulus"]})
    return replace(TRUE, chain=chain, uncertain=(Uncertain(KEY, known_to, relative=True),))


def traces(noise: float = 1e-3) -> pd.DataFrame:
    random = np.random.default_rng(1)
    measured = hc.Native(rtol=1e-8).run(TRUE, record=800).to_traces()
    for name in measured.columns[1:]:
        measured[name] += noise * measured[name].max() * random.normal(size=len(measured))
    measured["time_s"] += 1e-4
    return measured


def test_a_difference_that_the_modulus_explains() -> None:
    """A modulus 4 % off makes forces 1.6 % off; known to 5 %, that is 0.8 deviations."""
    found = hc.validate(believed(1.04, 0.05), traces(), tolerance=0.1, realisations=64)
    assert found.verdict == "pass"
    assert repr(found).endswith("Verdict: pass")
    peak, width, *_, time = found.compared
    assert peak.error / peak.number.measured == pytest.approx(1.04**0.4 - 1, rel=0.1)
    assert peak.input / peak.number.simulated == pytest.approx(0.4 * 0.05, rel=0.2)
    assert time.input / time.number.simulated == pytest.approx(0.4 * 0.05, rel=0.2)
    assert peak.ratio == pytest.approx(0.8, rel=0.25)
    assert peak.parts["numerical"] < 1e-6 * peak.number.simulated
    assert {peak.largest, time.largest} == {"input"}
    assert 0 < width.parts["measured"] < 0.1 * width.number.simulated


@pytest.mark.parametrize(
    ("modulus", "known_to", "tolerance", "verdict"),
    [
        (1.2, 0.01, 0.1, "fail"),  # 7 deviations
        (1.0, 0.01, 0.1, "pass"),
        (1.04, 0.2, 0.01, "undecided"),  # differences are seen from 29 % on
    ],
)
def test_three_verdicts(modulus: float, known_to: float, tolerance: float, verdict: str) -> None:
    found = hc.validate(believed(modulus, known_to), traces(), tolerance=tolerance, realisations=32)
    assert found.verdict == verdict
    assert bool(found) == (verdict == "pass")
    words = {"pass": "All ", "fail": f"{len(found.differing)} of ", "undecided": "Nothing could"}
    said = of_validation(found).verdict
    assert said.sentence.startswith(words[verdict])
    assert said.passed == {"pass": True, "fail": False, "undecided": None}[verdict]


def test_what_two_uncertainties_allow() -> None:
    """The three add as squares: 3, 4 and 12 are 13; twice that is allowed."""

    def one(error: float) -> Compared:
        # Half a uniform width of 3 sqrt(3) is a deviation of 3.
        number = Number(PEAK, "x", (), 100.0 + error, 100.0, 3.0 * 3**0.5, 12.0)
        return Compared(number, 4.0)

    assert one(13.0).uncertainty == pytest.approx(13.0)
    assert one(13.0).largest == "measured"
    assert one(-26.0).ratio == pytest.approx(2.0)
    assert one(-26.0).allowed == pytest.approx(26.0)
    assert one(0.0).seen_from == pytest.approx(0.13 * (2 + 1.645))


def test_the_command(hertzchain: Command, tmp_path: Path) -> None:
    believed(1.2, 0.01).to_toml(scene := tmp_path / "scene.toml")
    traces().to_csv(tmp_path / "traces.csv", index=False)
    files = (scene, tmp_path / "traces.csv")
    page = tmp_path / "page.html"
    done = hertzchain("judge", *files, "--tolerance", "0.1", "--report", page)
    assert done.status == 1
    assert "granule 4: first peak [N]" in done.out
    assert "numbers differ by more than 2 u_val" in done.out
    assert "Comparison errors and uncertainties" in page.read_text(encoding="utf-8")
