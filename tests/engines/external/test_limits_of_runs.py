"""Refused and stopped runs: unstable steps, time limits, motion without right digits."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native.plan import METHODS, SymplecticNystrom
from hertzchain.errors import RunFailed, StepUnstable, TooExpensive, Unpredictable
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import largest_difference
from tests.command_line import python
from tests.conftest import STEEL, paper_scene
from tests.effort import effort


@pytest.fixture(scope="module", autouse=True)
def _ready() -> None:
    """Loaded, or compiled, before anything is timed."""
    scene = paper_scene("cosine", 1.0, 2.0, granules=5)
    hc.Native(peaks_only=True).run(scene)
    hc.peak_forces([scene])


def test_a_refusal_names_what_is_cheaper_where_that_fits() -> None:
    """Peaks alone of 100,000 granules take a second, all of their motion a minute or more."""
    long = paper_scene("cosine", 1.0, 2.0, granules=100_000)
    with pytest.raises(TooExpensive, match=r"takes at least .*peaks_only=True"):
        hc.Native(time_limit=20).run(long)
    for native, record in (
        (hc.Native(time_limit=1e-4, peaks_only=True), None),
        (hc.Native(time_limit=1e-9), None),  # too short for the peaks, too
        (hc.Native(time_limit=20), 3),
    ):
        with pytest.raises(TooExpensive, match="takes at least") as refusal:
            native.run(long, record)
        assert "peaks_only" not in str(refusal.value)


def growth(name: str, z: float) -> float:
    """Return the growth of u'' = -u in a step z of a method, from its own ``step``."""
    stepper = METHODS[name].walker.stepper
    columns = []
    for displacement, velocity in ((1.0, 0.0), (0.0, 1.0)):
        u, v = displacement, velocity
        if isinstance(stepper, SymplecticNystrom):
            for kick, drift in zip(stepper.kicks, (*stepper.drifts, 0.0), strict=True):
                v -= kick * z * u
                u += drift * z * v
        else:  # of (u + iv)' = -i (u + iv): the series of the exponential up to the fourth power
            turned = (u + 1j * v) * sum((-1j * z) ** k / math.factorial(k) for k in range(5))
            u, v = turned.real, turned.imag
        columns.append((u, v))
    return float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T))))


@pytest.mark.parametrize("name", METHODS)
def test_the_interval_is_that_of_the_table(name: str) -> None:
    """Up to it oscillations grow by less than one per cent a step, just above by more."""
    interval = METHODS[name].interval
    inside = [growth(name, z) for z in np.linspace(0.01, interval, 2000)]
    assert max(inside) < 1.01
    assert growth(name, interval + 0.02) > 1.01


@pytest.mark.parametrize("name", METHODS)
def test_steps_above_the_limit_are_refused_before_the_run(name: str) -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0)
    limit = stable_step(scene, METHODS[name].interval)
    with pytest.raises(StepUnstable, match=f"{name} is stable up to .* choose a smaller dt"):
        hc.Native(name, 1.2 * limit).run(scene)


# Time limits


def test_a_run_above_the_limit_is_refused_before_it_starts() -> None:
    scene = hc.Scene(
        hc.Chain(60, **STEEL), hc.Pulse("cosine-triangular", 100.0, 2.0, rise_time=7e4)
    )

    def run() -> None:
        with pytest.raises(TooExpensive, match=r"2\.1e\+10 in 7e\+04 s, more than the 1e\+10"):
            hc.Native().run(scene)

    run()  # what it needs is loaded
    assert effort(run) < 1  # 0.005 measured


def test_a_run_is_stopped_at_the_limit() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=3000)  # the whole takes half a minute
    with pytest.raises(TooExpensive, match=r"stopped at the time limit of 1 s"):
        hc.Native("velocity-verlet", time_limit=1.0).run(scene)


@pytest.mark.parametrize(
    "whole",
    [
        lambda scene: hc.peak_forces([scene], time_limit=5, wanted="first"),
        lambda scene: hc.fit(scene, {2: 1.0, 3: 1.0, 4: 2.0}, ["chain.density"], time_limit=5),
        lambda scene: hc.spread(
            replace(scene, uncertain=(hc.Uncertain("chain.density", 0.1, True),)), 16, time_limit=5
        ),
    ],
    ids=["batch", "fit", "spread"],
)
def test_a_stopped_part_names_the_limit_of_the_whole(
    monkeypatch: pytest.MonkeyPatch, whole: Callable[[hc.Scene], object]
) -> None:
    def late(*_: object) -> None:
        raise Deadline(1e-3).passed()

    monkeypatch.setattr(hc.Native, "run", late)
    with pytest.raises(TooExpensive, match="stopped at the time limit of 5 s"):
        whole(paper_scene("cosine", 1.0, 2.0, granules=5))


def test_a_batch_is_stopped_at_the_limit() -> None:
    ratios = np.geomspace(0.1, 10, 30_000)  # ten seconds of two cores: 1,300

    def run() -> None:
        with pytest.raises(TooExpensive, match=r"stopped at the time limit of 0\.2 s"):
            hc.similar_peak_forces("cosine", ratios, 2.0, granules=500, time_limit=0.2)

    assert effort(run) < 200  # parts that have not begun are left out


# Motion without digits


def test_motion_that_multiplies_rounding_errors_says_how_far() -> None:
    """Repeated collisions put 1e-6 out of reach, but leave some digits."""
    scene = paper_scene("triangular", 5000.0, 1.2, granules=5)
    result = hc.Native(peaks_only=True).run(scene)
    finer = hc.Native("reference", 0.02 * scene.units.time, peaks_only=True).run(scene)
    assert 1e-6 < result.error_estimate < 1e-3
    error = largest_difference(result.peak_force, finer.peak_force)
    assert error <= result.error_estimate + finer.error_estimate


@pytest.mark.lammps
@pytest.mark.parametrize(("step", "error"), [(0.1, Unpredictable), (0.2, StepUnstable)])
def test_a_shorter_step_is_asked_for_where_it_may_help(step: float, error: type[RunFailed]) -> None:
    chaotic = paper_scene("cosine", 776.726, 1367.97, granules=21)
    with pytest.raises(error):
        hc.Lammps(step * chaotic.units.time).run(chaotic)


def test_one_such_scene_leaves_the_others_of_a_batch_alone() -> None:
    chaotic = paper_scene("cosine", 300.0, 500.0, granules=12)
    batch = hc.peak_forces([chaotic, paper_scene("cosine", 1.0, 2.0, granules=12)])
    assert batch.error_estimate[0] > 1e-3
    assert batch.error_estimate[1] <= 1e-6


# Errors that are small by chance


def one_difference_too_small() -> hc.Scene:
    """A pulse table whose peaks, at one step, agree with those at longer steps by chance."""
    chain = hc.Chain(3, 0.04292841912821261, 44446822.359361835, 0.3, 2978.816503003124)
    time = (0.02866473413465362, 0.02931204434757437, 0.03042185303109649, 0.030756235855268474)
    return hc.Scene(chain, hc.PulseTable(time, (0.0, 0.10308817299957271, 0.0, 0.9409053777567418)))


@pytest.mark.parametrize("dt", [9.76e-5, 9.9e-5, 5e-5])
@pytest.mark.parametrize("name", ["native", pytest.param("lammps", marks=pytest.mark.lammps)])
def test_a_difference_that_is_small_by_chance_is_not_believed(name: str, dt: float) -> None:
    scene = one_difference_too_small()
    true = hc.Native("reference").run(scene).peak_force
    run = hc.Native("velocity-verlet", dt).run if name == "native" else hc.Lammps(dt).run
    result = run(scene)
    assert largest_difference(result.peak_force, true) <= result.error_estimate


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux alone")
def test_bounded_memory_is_half_of_what_there_is() -> None:
    """Maps are not filled, so that nothing is taken."""
    code = (
        "import mmap, os\n"
        "from hertzchain.limits import bound_memory\n"
        "memory = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE')\n"
        "bound_memory(); bound_memory()\n"
        "kept = mmap.mmap(-1, int(0.45 * memory))\n"
        "try: mmap.mmap(-1, int(0.1 * memory))\n"
        "except OSError as problem: print(problem)\n"
    )
    done = python("-c", code, check=True)
    assert "Cannot allocate memory" in done.stdout
