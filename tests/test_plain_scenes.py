"""Code calibrated on plain scenes checks ``Scene.is_plain``, and is used for them alone."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines.native.methods import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.observables.error_bound import amplifies_errors
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.validity import refuse_hopeless_overlap
from hertzchain.verdict.formulas import formulas
from tests.conftest import paper_scene


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> hc.Scene:
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


def test_no_granule_is_left_behind(scene: hc.Scene) -> None:
    legs = scene.schedule(0.2 * scene.units.time)
    run = simulate(scene, legs, METHODS["srkn-11b"].walker, leave_behind=True)
    assert np.isfinite(run.displacement).all()


def test_a_second_run_tells_the_error(scene: hc.Scene) -> None:
    assert amplifies_errors(scene)
    batch = hc.peak_forces([scene], rtol=1e-3)
    one = hc.Native(rtol=1e-3).run(scene)
    # Without a second run the error would be that of the random scenes, 0.9 rtol.
    assert batch.error_estimate[0] < 0.6e-3
    assert largest_difference(batch.peak_force[0], one.peak_force) < 1e-6


def test_formulas_map_and_free_end_say_nothing(scene: hc.Scene) -> None:
    result = hc.Native(rtol=1e-4).run(scene)
    assert result.transition_granules is None
    assert result.solitary_wave.far_field_force is None
    assert "uniform free chains" in str(formulas(result).applicable)
    prediction = theory.predict(scene)
    assert "uniform free chains" in str(prediction.missing)
    assert np.isnan(prediction.peak_force).all()


def test_overlaps_are_not_known_before_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = paper_scene("cosine", 1.0, 2.0)
    deep = hc.Scene(scene.chain, hc.Pulse("cosine", 1e9, 2.0, momentum_ratio=1.0))
    with pytest.raises(hc.HertzchainError, match="radii"):
        refuse_hopeless_overlap(deep)
    monkeypatch.setattr(hc.Scene, "is_plain", False)
    refuse_hopeless_overlap(deep)
