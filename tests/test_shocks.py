"""Every shock of the registry goes through all that takes a scene; a new one is tried as it is."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines import liggghts, yade
from hertzchain.engines.external.accuracy import Softening
from hertzchain.errors import HertzchainError
from hertzchain.known.answer import lammps_deck, program_deck
from hertzchain.observables.error_bound import amplifies_errors
from hertzchain.observables.peaks import largest_difference
from hertzchain.report.contents import of_comparison
from hertzchain.report.document import describe
from hertzchain.report.files import plot_times
from hertzchain.report.page import page_of
from hertzchain.scene.file import SHOCKS, sections_of
from hertzchain.scene.keys import keys_of
from hertzchain.scene.shocks import Shock
from hertzchain.scene.starters import STARTERS, write_starter
from hertzchain.slips import with_rise_time
from hertzchain.verdict.check import formulas
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.known.test_deck import verdict
from tests.oracles.json_schema import problems
from tests.report.test_json_schema import scene_from, through_json
from tests.scenes import force_of

GRANULES = 6

NAMED = {
    hc.Sawtooth: hc.Sawtooth(200.0, 4e-5),
    hc.Trapezoid: hc.Trapezoid(200.0, 4e-5, rise_time=1e-5, fall_time=1e-5),
}
"""Shocks that the starter of a half sine names."""


@pytest.fixture(params=SHOCKS, ids=lambda kind: kind.__name__)
def scene(request: pytest.FixtureRequest, tmp_path: Path) -> hc.Scene:
    """A short scene of a starter of ``hertzchain init`` without further terms but a load."""
    for name in STARTERS:
        scene = hc.Scene.from_toml(write_starter(name, tmp_path / f"{name}.toml")[0])
        free = scene.wall is None and scene.contact is None
        alike = {"unlike granules", "local shock", "fixed granules"}.isdisjoint(scene.terms)
        if request.param in NAMED and name == "half-sine":
            scene = replace(scene, shock=NAMED[request.param])
        if type(scene.shock) is request.param and free and alike:
            granules = scene.chain.granules if scene.moves else GRANULES
            return replace(scene, chain=replace(scene.chain, granules=granules))
    raise AssertionError("a shock has a starter: a scene for hertzchain init")


def numbers_of(shock: Shock) -> list[str]:
    """The keys of a shock in its section that are numbers here, and not 0 or a granule."""
    numbers = [key for key in keys_of(type(shock)) if type(getattr(shock, key)) in (float, int)]
    return [key for key in numbers if key != "granule" and getattr(shock, key)]


def test_a_shock_is_public_and_has_words(scene: hc.Scene) -> None:
    shock = scene.shock
    assert getattr(hc, type(shock).__name__) is type(shock)
    assert shock.noun in describe(scene)


def test_files_and_json(scene: hc.Scene, tmp_path: Path) -> None:
    """A scene comes back from both; schema and reference page know its shock."""
    scene.to_toml(tmp_path / "own.toml")
    assert hc.Scene.from_toml(tmp_path / "own.toml") == scene
    sections = through_json(sections_of(scene))
    assert problems(sections, "parts.json", "/$defs/scene") == []
    assert scene_from(sections, tmp_path) == scene
    page = Path("docs/scene-reference.md").read_text(encoding="utf-8")
    words = [*(f"`{key}`" for key in keys_of(type(scene.shock))), f'"{scene.shock.profile_name}"']
    if scene.shock.section != "shock":
        words[-1] = f"[{scene.shock.section}]" if scene.shock.section else "`velocity`"
    assert [word for word in words if word not in page] == []


def test_the_force_is_that_of_its_own_formula(scene: hc.Scene) -> None:
    """Ramps against a formula that shares nothing with them."""
    time = np.linspace(0, 1.1, 1201) * max(scene.pulse_end, scene.units.time)
    largest = max(float(np.max(np.abs(scene.applied_force(time)))), scene.peak_force)
    pulse = scene.pulse
    force = (
        force_of(scene.shock, time)
        if pulse is None
        else theory.applied_force(time, pulse, scene.rise_time or 0.0)
    )
    # Rounding of times at the corners, over a rise of a few hundredths of the pulse.
    by_ramps = np.zeros_like(time)
    for ramp in scene.ramps:
        by_ramps += np.where((time >= ramp.start) & (time < ramp.end), ramp.force(time), 0.0)
    for values in (by_ramps, scene.applied_force(time)):
        assert values == pytest.approx(force, abs=1e-12 * largest)


def test_a_similar_scene_has_the_same_peaks(scene: hc.Scene) -> None:
    result, similar = map(hc.Native(rtol=1e-9).run, (scene, Softening(3).scene(scene)))
    # All factors are powers of two, but for roots of them: rounding.
    assert similar.peak_force == pytest.approx(result.peak_force, rel=1e-11)
    assert similar.scene.end_time == pytest.approx(8 * result.scene.end_time, rel=1e-14)


@pytest.mark.lammps
def test_compare_and_its_page(scene: hc.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Native, LAMMPS and Eq. 1 as written agree; momentum, energy and generated deck are right."""
    comparison = hc.compare(scene, record=plot_times(scene))
    assert [check for check in comparison.checks if not check.passed] == []
    assert any("Eq. 1 as written" in check.name for check in comparison.checks)
    assert problems(through_json(comparison.to_dict()), "compare.json") == []
    # Drawn once, and not written: that takes most of the time of a page.
    monkeypatch.setattr("hertzchain.report.page.pictures", lambda draw: [str(draw())])
    assert scene.shock.noun in page_of(of_comparison(comparison), "own.toml")


def test_other_engines_have_its_force(scene: hc.Scene) -> None:
    """Their decks are pure text; the ramps of each leg stand in it."""
    legs = scene.schedule(0.5 * scene.units.time)
    texts = [writer(scene, legs, [1] * len(legs)) for writer in (liggghts.watched, yade.watched)]
    for leg in legs:
        if leg.ramp is not None:
            assert all(repr(leg.ramp.end_force - leg.ramp.start_force) in text for text in texts)


@pytest.mark.lammps
def test_decks(scene: hc.Scene, tmp_path: Path) -> None:
    """That of LAMMPS passes in it; those of other codes are refused where their runs are."""
    path = tmp_path / "in.chain"
    path.write_text(lammps_deck(scene, None, 1e-3, "trial"), encoding="utf-8")
    assert verdict(path) == "PASS"
    held = [*[False] * (scene.chain.granules - 1), True]
    fixed = replace(scene, chain=replace(scene.chain, fixed=held))
    for engine in ("liggghts", "yade"):
        assert "peaks.csv" in program_deck(engine, scene, None, 1e-3, "trial")
        with pytest.raises(HertzchainError, match="not support fixed granules: take a scene"):
            program_deck(engine, fixed, None, 1e-3, "trial")


def test_predict(scene: hc.Scene) -> None:
    prediction = theory.predict(scene)
    assert problems(through_json(prediction.to_dict()), "predict.json") == []
    if scene.is_plain and scene.pulse is None:
        assert f"the shock is a {scene.shock.noun}:" in str(prediction.missing)


def test_sweep_every_number(scene: hc.Scene) -> None:
    """Each number of a shock can vary, and the rows are runs of their scenes."""
    for key in numbers_of(scene.shock):
        name, value = f"{scene.shock.section}.{key}", getattr(scene.shock, key)
        values = [value, 2 * value] if isinstance(value, int) else [value, 0.9 * value]
        table = hc.sweep(scene, {name: values}, backends="native").to_frame()
        assert table["failure"].isna().all(), table["failure"]
        peaks = [
            hc.Native().run(replace(scene, shock=replace(scene.shock, **{key: value}))).peak_force
            for value in values
        ]
        # Both are right to 1e-6.
        assert table["largest_peak_force_N"].tolist() == pytest.approx(
            [max(forces) for forces in peaks], rel=2e-6
        )
        assert table[name].tolist() == values


def test_batch(scene: hc.Scene) -> None:
    stronger = replace(scene, run=hc.Run(0.9 * scene.end_time))
    batch = hc.peak_forces([scene, stronger], rtol=1e-6)
    for k, member in enumerate((scene, stronger)):
        # Both are right to 1e-6.
        peaks = hc.Native(rtol=1e-6).run(member).peak_force
        assert batch.peak_force[k] == pytest.approx(peaks, rel=2e-6, abs=1e-9 * max(peaks))


def test_a_wrong_force_is_named(scene: hc.Scene) -> None:
    """The mistakes of a judgement know the shock, where it is not the only one with its terms."""
    if not scene.is_plain:
        return
    scene = with_rise_time(replace(scene, chain=replace(scene.chain, granules=12)))
    wrong = hc.Native().run(replace(scene, shock=scene.shock.stretched(force=1.3)))
    judgement = hc.judge(scene, wrong.peak_force)
    assert "applied force 1.3 times" in json.dumps(through_json(judgement.to_dict()))


def test_commands(scene: hc.Scene, tmp_path: Path, hertzchain: Command) -> None:
    """``run`` prints its words, ``predict`` ends well."""
    scene.to_toml(tmp_path / "own.toml")
    done = hertzchain("run", tmp_path / "own.toml")
    assert done.status == 0, done.err
    assert scene.shock.noun in done.out
    assert hertzchain("predict", tmp_path / "own.toml").status == 0


# Code calibrated on plain scenes checks ``Scene.is_plain``, and is used for them alone


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> hc.Scene:
    """A plain scene that is taken for one with terms."""
    monkeypatch.setattr(hc.Scene, "is_plain", False)
    return paper_scene("cosine", 1.0, 2.0, 20)


def test_a_scene_without_terms_is_plain_and_looks_as_before() -> None:
    scene = paper_scene("cosine", 1.0, 2.0)
    assert scene.is_plain
    assert "terms" not in "".join(scene.to_texts("scene.toml").values())
    copied = pickle.loads(pickle.dumps(scene))  # noqa: S301 - what stands here
    assert copied == scene
    assert hash(copied) == hash(scene)


def test_a_second_run_tells_the_error(taken: hc.Scene) -> None:
    assert amplifies_errors(taken)
    batch = hc.peak_forces([taken], rtol=1e-3)
    result = hc.Native(rtol=1e-3).run(taken)
    # Without a second run the error would be that of the random scenes, 0.9 rtol.
    assert batch.error_estimate[0] < 0.6e-3
    assert largest_difference(batch.peak_force[0], result.peak_force) < 1e-6


def test_formulas_map_and_free_end_say_nothing(taken: hc.Scene) -> None:
    result = hc.Native(rtol=1e-4).run(taken)
    assert result.transition_granules is None
    assert result.solitary_wave.far_field_force is None
    assert "uniform free chains" in str(formulas(result).applicable)
    prediction = theory.predict(taken)
    assert "uniform free chains" in str(prediction.missing)
    assert np.isnan(prediction.peak_force).all()
