"""Scenes with terms by LIGGGHTS and Yade: results against LAMMPS, decks, and refusals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.lammps import deck as lammps_deck
from hertzchain.engines.liggghts import deck as liggghts_deck
from hertzchain.engines.yade import deck as yade_deck
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.engines.external.test_same_steps import DAMPED
from tests.engines.lammps.test_lammps import largest
from tests.engines.native.test_terms import PULSE, SCENES, UNIFORM
from tests.scenes import load


@pytest.mark.lammps
@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(hc.Liggghts, marks=pytest.mark.liggghts),
        pytest.param(hc.Yade, marks=[pytest.mark.yade, pytest.mark.slow]),
    ],
)
def test_results_are_those_of_lammps(engine: type[ProgramEngine]) -> None:
    """Read at the same steps only round-off differs, in peaks and histories, wall and all."""
    scene = SCENES["all at once"]
    times = np.linspace(0.0, scene.end_time, 9)
    dt = 0.1 * scene.contact_time
    other, lammps = (each(dt=dt).run(scene, record=times) for each in (engine, hc.Lammps))
    assert [check.name for check in balance_checks(other) if not check.passed] == []
    allowed = 10 * other.lost_digits.bound
    assert allowed < 1e-9
    assert largest_difference(other.peak_force, lammps.peak_force) < allowed
    assert other.static_force == pytest.approx(lammps.static_force, rel=1e-15, abs=0)
    assert other.history is not None
    assert lammps.history is not None
    for name in ("displacement", "velocity", "contact_force"):
        of_other, of_lammps = getattr(other.history, name), getattr(lammps.history, name)
        # Interpolated between readings that differ by round-off, at its end as in the test above.
        assert largest(of_other, of_lammps) < 2e-9


COMPUTED = {law: DAMPED[law] for law in ("restitution", "viscoelastic")}
WRITTEN = {**SCENES, **COMPUTED, "plain": load("demo")}


@pytest.mark.parametrize("name", WRITTEN)
def test_decks_have_no_mass_no_stiffness_and_no_damping_computed_here(name: str) -> None:
    """Any of them would hide a mistake."""
    scene = WRITTEN[name]
    legs, each = scene.schedule(0.1 * scene.contact_time), scene.granules
    strides = [1] * len(legs)
    decks = [liggghts_deck.watched(scene, legs, strides)]
    if name != "viscoelastic":  # which Yade does not have
        decks.append(yade_deck.watched(scene, legs, strides))
    computed = [each.stiffness, each.mass, *([] if each.damping is None else [each.damping])]
    for text in decks:
        assert scene.is_plain or all(repr(x) in text for x in each.position.tolist())
        for value in set(np.concatenate(computed).tolist()):
            assert f"{value:.6g}"[:6] not in text


@dataclass(frozen=True)
class Plain(hc.Liggghts):
    """An engine that can have no terms."""

    TERMS: ClassVar[tuple[str, ...]] = ()


@pytest.mark.parametrize("name", SCENES)
def test_an_engine_refuses_terms_that_it_does_not_list(name: str) -> None:
    scene = SCENES[name]
    with pytest.raises(RunFailed, match=f"LIGGGHTS does not support {', '.join(scene.terms)}"):
        Plain(program="no-such").run(scene)


@pytest.mark.liggghts
def test_a_poisson_ratio_that_liggghts_does_not_know() -> None:
    auxetic = replace(UNIFORM, poisson_ratio=[0.3] * 11 + [-0.1])
    wall = hc.Wall("elastic", 1e9, -0.2)
    for scene, said in (
        (hc.Scene(auxetic, PULSE), "this chain has -0.1"),
        (hc.Scene(UNIFORM, PULSE, wall=wall), "this wall has -0.2"),
    ):
        with pytest.raises(RunFailed, match=f"no Poisson's ratio below 0, {said}"):
            hc.Liggghts(dt=1e-6).run(scene)


def test_decks_that_would_be_too_long() -> None:
    unlike = {**STEEL, "young_modulus": np.linspace(193e9, 194e9, 101)}
    with pytest.raises(RunFailed, match="of 101 materials, a LIGGGHTS deck has at most 100"):
        liggghts_deck.set_up(hc.Scene(hc.Chain(101, **unlike), hc.Striker(1.0)))
    long = hc.Scene(hc.Chain(100_001, **STEEL), hc.Striker(1.0))
    with pytest.raises(RunFailed, match="LAMMPS deck of 100001 granules would be too"):
        lammps_deck.set_up(long)
    with pytest.raises(RunFailed, match="LIGGGHTS deck of 100001 granules would be too"):
        liggghts_deck.set_up(long)
    with pytest.raises(RunFailed, match="Yade with 100001 granules would be too long"):
        yade_deck.watched(long, [], [])
