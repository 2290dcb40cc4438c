"""Scenes with terms by LAMMPS, LIGGGHTS and Yade: results, accuracy, decks, drives, refusals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines import liggghts, yade
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.lammps import deck as lammps_deck
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL
from tests.engines.lammps.test_lammps import largest
from tests.scenes import (
    DAMPED,
    DASHPOT,
    PISTONS,
    PULSE,
    RESTITUTION,
    SINES,
    TERMS,
    UNIFORM,
    VISCOELASTIC,
    load,
)


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
    scene = TERMS["all at once"]
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
WRITTEN = {**TERMS, **COMPUTED, "plain": load("demo")}


@pytest.mark.parametrize("name", WRITTEN)
def test_decks_have_no_mass_no_stiffness_and_no_damping_computed_here(name: str) -> None:
    """Any of them would hide a mistake."""
    scene = WRITTEN[name]
    legs, each = scene.schedule(0.1 * scene.contact_time), scene.granules
    strides = [1] * len(legs)
    decks = [liggghts.watched(scene, legs, strides), lammps_deck.set_up(scene)]
    if name != "viscoelastic":  # which Yade does not have
        decks.append(yade.watched(scene, legs, strides))
    computed = [each.stiffness, each.mass, *([] if each.damping is None else [each.damping])]
    for text in decks:
        assert scene.is_plain or all(repr(x) in text for x in each.position.tolist())
        for value in set(np.concatenate(computed).tolist()):
            assert f"{value:.6g}"[:6] not in text


@dataclass(frozen=True)
class Plain(hc.Liggghts):
    """An engine that can have no terms."""

    TERMS: ClassVar[tuple[str, ...]] = ()


@pytest.mark.parametrize("name", TERMS)
def test_an_engine_refuses_terms_that_it_does_not_list(name: str) -> None:
    scene = TERMS[name]
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
        liggghts.set_up(hc.Scene(hc.Chain(101, **unlike), hc.Striker(1.0)))
    long = hc.Scene(hc.Chain(100_001, **STEEL), hc.Striker(1.0))
    with pytest.raises(RunFailed, match="LAMMPS deck of 100001 granules would be too"):
        lammps_deck.set_up(long)
    with pytest.raises(RunFailed, match="LIGGGHTS deck of 100001 granules would be too"):
        liggghts.set_up(long)
    with pytest.raises(RunFailed, match="Yade with 100001 granules would be too long"):
        yade.watched(long, [], [])


EACH = [
    pytest.param(hc.Liggghts, marks=[pytest.mark.liggghts, pytest.mark.slow]),
    pytest.param(hc.Yade, marks=[pytest.mark.yade, pytest.mark.slow]),
]


@pytest.mark.parametrize("engine", EACH)
@pytest.mark.parametrize(("rtol", "extrapolated"), [(1e-2, False), (1e-5, True)])
def test_the_wanted_error(engine: type[ProgramEngine], rtol: float, extrapolated: bool) -> None:
    scene = replace(TERMS["all at once"], contact=RESTITUTION)
    result = engine(rtol=rtol, extrapolated=extrapolated).run(scene)
    truth = hc.Native(rtol=1e-9).run(scene)
    error = largest_difference(result.peak_force, truth.peak_force)
    assert error <= result.error_estimate <= rtol
    assert [check for check in balance_checks(result) if not check.passed] == []
    if not extrapolated:  # balances are of one run
        lost = truth.balance.dissipated
        assert result.balance.dissipated == pytest.approx(lost, rel=rtol, abs=0)


def test_laws_that_an_engine_does_not_have() -> None:
    scene = TERMS["all at once"]
    small = hc.Contact("restitution", restitution=0.05)
    laws = {law: scene.contact for law, scene in DAMPED.items()}
    allowed = [None, *laws.values(), replace(small, restitution=math.nextafter(0.05, 1))]
    for engine, some in ((hc.Liggghts, allowed), (hc.Yade, [None, RESTITUTION])):
        for law in some:
            engine()._refuse(replace(scene, contact=law))
    for engine, law, words in (
        (hc.Liggghts, replace(DASHPOT, attraction=False), "dashpots always pull in LIGGGHTS: set"),
        (hc.Liggghts, small, "restitution above 0.05, this one is 0.05: take another"),
        (hc.Yade, VISCOELASTIC, "Yade has no viscoelastic damping with Hertz's law"),
        (hc.Yade, DASHPOT, "Yade has no dashpot damping with Hertz's law"),
        (hc.Yade, laws["restitution, pulling"], "never pull in Yade: leave out attraction"),
    ):
        with pytest.raises(RunFailed, match=words):
            engine()._refuse(replace(scene, contact=law))


def test_the_damping_of_a_viscoelastic_deck() -> None:
    """3/2 A k over the contact mass, from the material; k = 4/3 E* without the radius."""
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Striker(1.0), contact=VISCOELASTIC)
    text = liggghts.set_up(scene).replace("&\n", "")
    modulus = STEEL["young_modulus"] / (2 * (1 - STEEL["poisson_ratio"] ** 2))
    mass = STEEL["density"] * 4 / 3 * math.pi * STEEL["radius"] ** 3 / 2
    expected = 1.5e-6 * 4 / 3 * modulus / mass
    damping = float(text.partition("gamman peratomtypepair 1 ")[2].split()[0])
    assert damping == pytest.approx(expected, rel=1e-12)  # rounding


@pytest.mark.parametrize("engine", [hc.Liggghts, hc.Yade])
def test_damping_of_the_walls_own_is_refused_before_a_run(engine: type[ProgramEngine]) -> None:
    wall = hc.Wall("rigid", restitution=0.5)
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Striker(1.0), wall=wall, contact=RESTITUTION)
    with pytest.raises(RunFailed, match="gets one damping for all contacts: take a wall without"):
        engine()._refuse(scene)


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", [pytest.param("column", marks=pytest.mark.slow), "above the cut-off, wall"]
)
def test_comparisons(name: str) -> None:
    compared = hc.compare((PISTONS | SINES)[name])
    assert [check for check in compared.checks if not check.passed] == []
    assert compared.verdict == "pass"


@pytest.mark.lammps
@pytest.mark.parametrize(
    "other", [hc.Sine(10.00001, 8000.0, 3), hc.Sine(10.0, 8000.1, 3), hc.Sine(10.0, 8000.0, 4)]
)
def test_another_sine_is_found(other: hc.Sine) -> None:
    scene = (PISTONS | SINES)["as strong as the load"]
    run, load = hc.Run(scene.end_time), hc.Precompression(10.1)
    scene = hc.Scene(scene.chain, scene.shock, run, precompression=load)
    result = hc.Lammps(dt=0.02 * scene.contact_time).run(scene)
    assert all(check.passed for check in same_steps_checks(result))
    mistaken = replace(result, scene=replace(scene, shock=other))
    assert not all(check.passed for check in same_steps_checks(mistaken))


@pytest.mark.lammps
@pytest.mark.parametrize(
    "law", [None, pytest.param(hc.Contact("restitution", restitution=0.8), marks=pytest.mark.slow)]
)
def test_a_slow_sine_has_not_diverged(law: hc.Contact | None) -> None:
    """It throws a free chain at 26 m/s and catches it again, though its impulse is 0."""
    shock, pressed = hc.Sine(100.0, 100.0, 1), hc.Precompression(100.0)
    scene = hc.Scene(hc.Chain(3, **STEEL), shock, precompression=pressed, contact=law)
    result, native = (code(rtol=1e-3).run(scene) for code in (hc.Lammps, hc.Native))
    error = largest_difference(result.peak_force, native.peak_force)
    assert error <= result.error_estimate + native.error_estimate
