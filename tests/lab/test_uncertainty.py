"""Uncertain values: what they make of results, and measured traces against uncertain scenes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.lab import validation
from hertzchain.lab.spread import Realisations, first_order, print_spread
from hertzchain.lab.validation import compared_numbers, of_validation
from hertzchain.report.console import plain_text
from hertzchain.scene.terms import Uncertain
from hertzchain.verdict.traces import PEAK, Number
from tests.command_line import Command
from tests.conftest import STEEL

# What uncertain values make of results: closed forms, similarity, and plain random runs


STRIKER = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(0.5))
EACH = (Uncertain("chain.radius", 1e-6, each=True),)
MODULUS, SPEED = "chain.young_modulus", "striker.velocity"
SCENE = replace(
    STRIKER,
    uncertain=(Uncertain(MODULUS, 0.05, relative=True), Uncertain(SPEED, 0.02, uniform=True)),
)


def test_every_result_goes_with_powers_of_modulus_and_speed() -> None:
    """By similarity forces of elastic spheres go as E^0.4 v^1.2, times as E^-0.4 v^-0.2."""
    spread = hc.spread(SCENE, 64, rtol=1e-6)
    drawn = list(Realisations(SCENE, 64, 1))
    modulus = np.array([scene.chain.first_modulus for scene in drawn]) / STEEL["young_modulus"]
    speed = np.array([scene.shock.start_velocity for scene in drawn]) / 0.5
    for name, powers in {"first_peak_force_N": (0.4, 1.2), "arrival_time_s": (-0.4, -0.2)}.items():
        k = spread.names.index((name, "contact 5"))
        expected = spread.nominal[k] * modulus ** powers[0] * speed ** powers[1]
        # both runs of a ratio are within 1e-6
        assert spread.values_of(name, "contact 5") == pytest.approx(expected, rel=2e-6)
        parts = np.array([powers[0] * 0.05, powers[1] * 0.04 / np.sqrt(3)]) ** 2
        # of 64 draws a variance is known to 2 sqrt(2 / 64) of itself
        assert spread.shares[:, k] == pytest.approx(parts / parts.sum(), abs=0.06)
    table = spread.to_frame()
    assert len(table) == len(spread.names) == spread.values.shape[1]
    k = spread.names.index(("first_peak_force_N", "contact 5"))
    low, nominal, high = (table[name].to_numpy()[k] for name in ("low_5", "nominal", "high_95"))
    assert low < nominal < high
    values = spread.values[:, k]
    # 5 % of 64, rounded up
    assert [int(np.sum(values < low)), int(np.sum(values > high))] == [4, 4]
    without = spread.values.copy()
    without[:3, k] = np.nan
    partly = replace(spread, values=without)
    assert "results without a spread: 1, as 3 of 64" in partly.remarks[0]
    for results, said in ((spread, 0), (partly, 1)):
        text = plain_text(partial(print_spread, spread=results, every=True))
        assert text.count("cut off") == said
        assert text.count(" none") == 0
    assert spread.deviation[k] / nominal == pytest.approx(np.hypot(0.02, 0.0277), rel=0.1)
    assert "contact 5" in repr(spread)
    assert "contact 6" not in repr(spread)
    assert len(spread.plot().axes) == 2


INPUTS = tuple(Uncertain(f"chain.{key}", 1.0, uniform=True) for key in ("a", "b", "c"))


def test_shares_of_a_linear_and_of_a_strongly_nonlinear_function() -> None:
    """Ishigami's function (a 7, b 0.1) has first-order indices 0.3139, 0.4424 and 0."""
    from scipy.stats import qmc

    places = qmc.Sobol(3, seed=2).random_base2(10)
    x = np.pi * (2 * places - 1)
    line = 3 * x[:, 0] + 2 * x[:, 1] + x[:, 2]
    bent = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    none = np.ones(len(x))
    shares = first_order(INPUTS, places, np.stack([line, bent, none], axis=1))
    # 1,024 draws: a variance is known to some 4 %
    assert shares[:, 0] == pytest.approx(np.array([9, 4, 1]) / 14, abs=0.01)
    assert shares[:, 1] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
    assert np.isnan(shares[:, 2]).all()
    normal = tuple(replace(entry, uniform=False) for entry in INPUTS)
    from scipy.special import ndtri

    z = ndtri(places)
    shares = first_order(normal, places, (3 * z[:, 0] + 2 * z[:, 1] + z[:, 2])[:, np.newaxis])
    assert shares[:, 0] == pytest.approx(np.array([9, 4, 1]) / 14, abs=0.01)


def test_what_is_drawn() -> None:
    gaps = replace(
        STRIKER,
        uncertain=(
            Uncertain("chain.gap", 1e-6, each=True),
            Uncertain("chain.radius", 0.01, relative=True, uniform=True, each=True),
        ),
    )
    scenes = list(Realisations(gaps, 64, 3))
    assert scenes == list(Realisations(gaps, 64, 3))
    assert scenes != list(Realisations(gaps, 64, 4))
    gap = np.array([scene.granules.gap for scene in scenes])
    assert np.count_nonzero(gap == 0) / gap.size == pytest.approx(0.5, abs=0.1)  # below 0 is none
    assert np.std(gap[gap > 0]) == pytest.approx(1e-6 * np.sqrt(1 - 2 / np.pi), rel=0.15)
    radius = np.array([scene.granules.radius for scene in scenes]) / STEEL["radius"]
    assert np.abs(radius - 1).max() <= 0.01
    assert np.std(radius) == pytest.approx(0.01 / np.sqrt(3), rel=0.05)
    assert np.corrcoef(radius[:, 2], radius[:, 3])[0, 1] == pytest.approx(0, abs=0.3)


def test_scatter_makes_what_plain_random_chains_make() -> None:
    """Radii that scatter by 1 %, against NumPy's draws."""
    scatter = Uncertain("chain.radius", 0.01, relative=True, each=True)
    scene = hc.Scene(hc.Chain(6, **STEEL), hc.Striker(0.44), wall=hc.Wall("same"))
    spread = hc.spread(replace(scene, uncertain=(scatter,)), 256)
    force = spread.values_of("first_peak_force_N", "the wall")
    radii = STEEL["radius"] * (1 + 0.01 * np.random.default_rng(5).standard_normal((256, 6)))
    scenes = [replace(scene, chain=replace(scene.chain, radius=radius)) for radius in radii]
    plain = hc.peak_forces(scenes, 1e-4, wanted="first").first_columns["first_peak_force_N"][:, -1]
    # Both means and both deviations are off by parts of the deviation: three standard errors.
    assert force.mean() == pytest.approx(plain.mean(), abs=3 * plain.std() * np.sqrt(2 / 256))
    assert force.std() / plain.std() == pytest.approx(1, abs=3 * np.sqrt(1 / 256))


def test_velocities_scatter_but_those_of_fixed_granules() -> None:
    velocity, fixed = [1.0, 0.0, 0.0, 0.0], [False, False, True, False]
    scatter = Uncertain("chain.velocity", 0.1, each=True)
    scene = hc.Scene(hc.Chain(4, **STEEL, velocity=velocity, fixed=fixed), uncertain=(scatter,))
    assert len(hc.spread(scene, 16).plot().axes) == 1  # no input has a share
    drawn = np.array([scene.chain.velocity for scene in Realisations(scene, 64, 3)]) - velocity
    assert not drawn[:, 2].any()
    # 64 draws of a standard deviation: 9 %
    assert np.std(drawn[:, [0, 1, 3]], axis=0) == pytest.approx(np.full(3, 0.1), rel=0.3)


def test_a_file_has_what_is_uncertain(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    STRIKER.to_toml(file)
    file.write_text(
        file.read_text(encoding="utf-8")
        + '\n[uncertainty]\nyoung_modulus = "5 %"\n'
        + 'striker.velocity = {half_width = "2 cm/s"}\n[scatter]\nradius = "2 um"\n',
        encoding="utf-8",
    )
    scene = hc.Scene.from_toml(file)
    radius = Uncertain("chain.radius", 2e-6, each=True)
    assert set(scene.uncertain) == {*SCENE.uncertain, radius}
    scene.to_toml(file)
    assert hc.Scene.from_toml(file) == scene
    assert hc.Native().run(scene).peak_force == pytest.approx(hc.Native().run(STRIKER).peak_force)


@pytest.mark.parametrize(
    ("uncertain", "granules", "count", "said"),
    [
        ((), 8, 16, "nothing is uncertain"),
        ((Uncertain("chain.young", 1.0),), 8, 16, "did you mean chain.young_modulus"),
        ((Uncertain("chain.granules", 1.0),), 8, 16, "cannot be uncertain"),
        ((Uncertain("striker.young_modulus", 1e9),), 8, 16, "has no value of its own"),
        ((Uncertain("run.end_time", 1e-6),), 8, 16, "cannot be uncertain"),
        ((Uncertain("chain.gap", 0.1, relative=True),), 8, 16, "of which there is no share"),
        ((Uncertain("chain.poisson_ratio", 0.4),), 8, 16, "lower its uncertainty"),
        ((Uncertain("wall.gap", 1e-6),), 8, 16, "the scene has no \\[wall\\]"),
        (EACH, 21_202, 16, "uncertain values = 21202: must be at most 21201"),
        *((EACH, 8, count, "must be an integer from 16") for count in (15, 2**17 + 1, True, 20.0)),
    ],
)
def test_what_cannot_be_uncertain(uncertain: Any, granules: int, count: Any, said: str) -> None:
    scene = replace(STRIKER, chain=hc.Chain(granules, **STEEL), uncertain=uncertain)
    with pytest.raises(SceneError, match=said):
        hc.spread(scene, count)


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ('[uncertainty]\n"chain.radius" = "1e %"', "must be a standard deviation"),
        ('[uncertainty]\n"chain.radius" = "x %"', "must be a number"),
        ('[uncertainty]\n"chain.radius" = "0 %"', "must be a standard deviation"),
        ('[uncertainty]\n"chain.radius" = {half_width = 1, x = 2}', "or {half_width = ...}"),
        ('[uncertainty]\n"chain.radius" = "5 kg"', "wrong dimension"),
        ('[uncertainty]\n"colour" = "5 %"', "write the key as in the scene"),
        ('[uncertainty]\n"chain.colour" = "5 %"', "has no quantity"),
        ('[uncertainty]\n"chain.granules" = 1', "has no quantity"),
        ('[scatter]\n"striker.velocity" = "5 %"', "must be chain.radius"),
        ('[uncertainty]\n"chain.radius" = "5 %"\nchain.radius = 1e-5', "is uncertain twice"),
        ('[uncertainty]\n"chain.radius" = {}', "must be a standard deviation"),
        ("uncertainty = 5", "must be a section"),
    ],
)
def test_a_file_that_says_it_wrong(section: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    STRIKER.to_toml(file)
    whole = file.read_text(encoding="utf-8")
    at_top = not section.startswith("[")
    file.write_text(f"{section}\n{whole}" if at_top else f"{whole}\n{section}\n", encoding="utf-8")
    with pytest.raises(SceneError, match=said):
        hc.Scene.from_toml(file)


def test_realisations_that_end_too_early_are_no_results() -> None:
    """A speed 20 % lower is on its way where the run ends: its force there is no peak."""
    end = float(hc.Native().run(STRIKER).peak_time[-1]) * 1.08
    wide = (Uncertain(SPEED, 0.2, relative=True),)
    spread = hc.spread(replace(STRIKER, run=hc.Run(end), uncertain=wide), 64)
    assert "known from 32 realisations on" in hc.spread(spread.scene, 16).remarks[-1]
    last = spread.values_of("first_peak_force_N", "contact 8")
    third = spread.values_of("first_peak_force_N", "contact 3")
    peaked = ~np.isnan(last)
    assert 10 < np.count_nonzero(peaked) < 64
    # the same powers of the speed
    ratio = last[peaked] / third[peaked]
    assert ratio == pytest.approx(np.full(ratio.size, ratio[0]), rel=1e-3)
    assert "give a later end_time" in spread.remarks[0]


def test_keys_of_segments_have_the_values_of_their_segment(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        """
[chain]
granules = 6
radius = "5 mm"
young_modulus = "200 GPa"
poisson_ratio = 0.3
density = 8000
[[chain.segments]]
granules = 3
[[chain.segments]]
granules = 3
radius = "4 mm"
[striker]
velocity = 1
[uncertainty]
"chain.segments.1.radius" = "1 %"
"chain.segments.2.radius" = {half_width = "2 %"}
""",
        encoding="utf-8",
    )
    scenes = list(Realisations(hc.Scene.from_toml(tmp_path / "scene.toml"), 64, 1))
    radius = np.array([scene.granules.radius for scene in scenes])
    assert radius.mean(axis=0) == pytest.approx([5e-3] * 3 + [4e-3] * 3, rel=2e-3)
    assert radius.std(axis=0) == pytest.approx([5e-5] * 3 + [8e-5 / 3**0.5] * 3, rel=0.1)


def test_the_command(hertzchain: Command, tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    SCENE.to_toml(file)
    run = ("spread", file, "-n", "16")
    done = hertzchain(*run, "-o", tmp_path / "spread.csv", "--plot", tmp_path / "spread.png")
    assert done.status == 0
    assert "realisations: 16" in done.out
    assert "contact 5" in done.out
    assert "contact 6" not in done.out
    assert "contact 6" in hertzchain(*run, "--all").out
    header = (tmp_path / "spread.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert header.startswith("result,at,nominal,mean,deviation,low_5,high_95,share chain")
    assert (tmp_path / "spread.png").stat().st_size > 10_000


# Measured traces: three uncertainties, and what could have been seen


GAUGES = (hc.Gauge(granule=4), hc.Gauge(granule=8))
TRUE = hc.Scene(hc.Chain(10, **STEEL), hc.Striker(0.5), gauges=GAUGES)
KEY = "chain.young_modulus"


def believed(modulus: float, known_to: float) -> hc.Scene:
    chain = hc.Chain(10, **{**STEEL, "young_modulus": modulus * STEEL["young_modulus"]})
    return replace(TRUE, chain=chain, uncertain=(Uncertain(KEY, known_to, relative=True),))


def traces(noise: float = 1e-3) -> Any:
    random = np.random.default_rng(1)
    measured = hc.Native(rtol=1e-8).run(TRUE, record=800).to_traces()
    for name in measured.columns[1:]:
        measured[name] += noise * measured[name].max() * random.normal(size=len(measured))
    measured["time_s"] += 1e-4
    return measured


def test_a_difference_that_the_modulus_explains() -> None:
    """A modulus 4 % off makes forces 1.6 % off; known to 5 %, that is 0.8 deviations."""
    check = hc.validate(believed(1.04, 0.05), traces(), tolerance=0.1, realisations=64)
    assert check.verdict == "pass"
    assert repr(check).endswith("Verdict: pass")
    rows: list[Any] = list(check.compared.itertuples())
    peak, width, *_, time = rows
    assert peak.error / peak.measured == pytest.approx(1.04**0.4 - 1, rel=0.1)
    assert peak.u_input / peak.simulated == pytest.approx(0.4 * 0.05, rel=0.2)
    assert time.u_input / time.simulated == pytest.approx(0.4 * 0.05, rel=0.2)
    assert peak.error_over_u == pytest.approx(0.8, rel=0.25)
    assert peak.u_numerical < 1e-6 * peak.simulated
    assert {peak.largest, time.largest} == {"input"}
    assert 0 < width.u_measured < 0.1 * width.simulated


@pytest.mark.parametrize(
    ("modulus", "known_to", "tolerance", "verdict"),
    [
        (1.2, 0.01, 0.1, "fail"),  # 7 deviations
        (1.0, 0.01, 0.1, "pass"),
        (1.04, 0.2, 0.01, "undecided"),  # differences are seen from 29 % on
    ],
)
def test_three_verdicts(modulus: float, known_to: float, tolerance: float, verdict: str) -> None:
    check = hc.validate(believed(modulus, known_to), traces(), tolerance=tolerance, realisations=16)
    assert check.verdict == verdict
    assert bool(check) == (verdict == "pass")
    words = {"pass": "All ", "fail": f"{len(check.differing)} of ", "undecided": "Nothing could"}
    document = of_validation(check)
    for overlay in document.overlays:
        assert overlay.band is not None
        (low, high), crest = overlay.band, int(np.argmax(overlay.expected))
        assert low[crest] < overlay.expected[crest] < high[crest]
    said = document.verdict
    assert said.sentence.startswith(words[verdict])
    assert said.passed == {"pass": True, "fail": False, "undecided": None}[verdict]


def test_what_two_uncertainties_allow() -> None:
    """The three add as squares: 3, 4 and 12 are 13; twice that is allowed."""
    # Half a uniform width of 3 sqrt(3) is a deviation of 3.
    numbers = [Number(PEAK, "x", (), 100.0 + off, 100.0, 3.0 * 3**0.5, 12.0) for off in (0, -26)]
    table = compared_numbers(numbers, [4.0, 4.0])
    assert table["u_validation"].tolist() == pytest.approx([13.0, 13.0])
    assert table["largest"].tolist() == ["measured", "measured"]
    assert table["error_over_u"].tolist() == pytest.approx([0.0, 2.0])
    assert table["seen_from"][0] == pytest.approx(0.13 * (2 + 1.645))
    assert compared_numbers([], []).columns.tolist() == table.columns.tolist()


def test_the_command_that_judges(
    hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation, "validate", partial(validation.validate, realisations=32))
    believed(1.2, 0.01).to_toml(scene := tmp_path / "scene.toml")
    traces().to_csv(tmp_path / "traces.csv", index=False)
    files = (scene, tmp_path / "traces.csv")
    page = tmp_path / "page.html"
    done = hertzchain("judge", *files, "--tolerance", "0.1", "--report", page)
    assert done.status == 1
    assert "granule 4: first peak [N]" in done.out
    assert "numbers differ by more than 2 u_val" in done.out
    text = page.read_text(encoding="utf-8")
    assert "Comparison errors and uncertainties" in text
    assert "[uncertainty]" in text  # of the scene, which gives the page again
    assert "reference, 5 to 95 % by uncertain input" in text
