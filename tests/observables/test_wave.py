"""The wave between two contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.observables.wave import places
from tests.conftest import STEEL, paper_scene

LONG = hc.Scene(hc.Chain(40, **STEEL), hc.Striker(1.0))


def test_places_of_contacts() -> None:
    """Radii 1, 2 and 3 mm, gaps of 0.1 mm and a wall 0.2 mm away, by hand."""
    chain = hc.Chain(3, **{**STEEL, "radius": [1e-3, 2e-3, 3e-3]}, gap=1e-4)
    scene = hc.Scene(chain, hc.Striker(1.0), wall=hc.Wall("rigid", gap=2e-4))
    expected = np.array([1.05, 1.1 + 4 + 0.05, 1.1 + 4 + 0.1 + 6 + 0.1]) * 1e-3
    assert places(scene) == pytest.approx(expected, rel=1e-14)


def test_the_errors_are_bounds() -> None:
    """Velocity Verlet is off by parts of its bounds, as ten times the accuracy tells."""
    true = hc.Native(rtol=1e-9).run(LONG).wave(20, 30)
    found = hc.Native("velocity-verlet", 5e-7).run(LONG).wave(20, 30)
    for name in ("speed", "height", "width"):
        off = abs(getattr(found, name) / getattr(true, name) - 1)
        assert off <= getattr(found, f"{name}_error") + getattr(true, f"{name}_error"), name
        assert off > 1e-3 * getattr(found, f"{name}_error"), name


def test_the_usual_pair_is_before_the_end() -> None:
    result = hc.Native(rtol=1e-6).run(LONG)
    wave = result.usual_wave
    assert wave == result.wave(28, 38)
    assert wave.width_granules == pytest.approx(1.41, abs=0.01)
    damped = replace(LONG, contact=hc.Contact("restitution", restitution=0.95))
    slow = hc.Native(rtol=1e-6).run(damped).usual_wave
    assert (slow.first, slow.last) == (23, 33)
    assert hc.Native().run(paper_scene("cosine", 1.0, 2.0, 12)).usual_wave is None
    assert result.to_dict()["wave"]["speed_m_s"] == wave.speed


def test_a_piston_that_squeezes_a_chain_sends_no_wave_from_its_end() -> None:
    """There the far contacts reach half of their largest force before those at the piston."""
    scene = hc.Scene(hc.Chain(6, **STEEL), hc.Piston(0.1), wall=hc.Wall("rigid"))
    result = hc.Native(rtol=1e-6).run(scene)
    assert result.usual_wave is None
    assert result.to_dict()["wave"] is None


def test_what_has_no_wave_is_refused() -> None:
    result = hc.Native(rtol=1e-6).run(replace(LONG, run=hc.Run(1e-4)))
    with pytest.raises(SceneError, match="must have clear first pulses"):
        result.wave(20, 40)
    for pair in ((5, 5), (1, 4), (4, 41)):
        with pytest.raises(SceneError, match="must be two contacts from 2 to 40"):
            result.wave(*pair)
    with pytest.raises(SceneError, match="needs first pulses"):
        hc.Native(wanted="all").run(LONG).wave(20, 30)


def test_contacts_near_the_end_are_marked() -> None:
    """Two, and seven where contacts are damped: there the usual wave does not go."""
    for contact, count in ((None, 2), (hc.Contact("restitution", restitution=0.9), 7)):
        scene = hc.Scene(hc.Chain(20, **STEEL), hc.Striker(1.0), contact=contact)
        result = hc.Native().run(scene)
        marked = result.contact[result.first_columns["near_end"]]
        assert marked.tolist() == list(range(21 - count, 21))
        assert result.usual_wave.last == 20 - count
