"""The native oracle: known answers, convergence, and its kernels against equations as written."""

from __future__ import annotations

import ast
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import (
    damped_kernel,
    elastic,
    simulation,
    verlet,
)
from hertzchain.engines.native.as_written import RungeKutta
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import (
    METHODS,
    SRKN_11B,
    VELOCITY_VERLET,
    RungeKutta4,
    Stepper,
    Walker,
)
from hertzchain.engines.native.simulation import simulate, stoppable
from hertzchain.limits import Deadline
from hertzchain.observables.samples import Recorder
from hertzchain.scene.schedule import Leg
from hertzchain.theory import solitary_wave as exact
from tests.conftest import STEEL, paper_scene
from tests.oracles.in_numpy import simulate_in_numpy

REFERENCE = METHODS["reference"].walker


def natural_peaks(scene: hc.Scene, step: float, walker: Any = REFERENCE) -> Any:
    """Peaks in natural units of one run with a step in natural units."""
    return simulate(scene, scene.schedule(step * scene.units.time), walker).peaks.force


def test_forces_are_those_of_equation_1() -> None:
    displacement = np.array([3.0, 1.0, 0.75, 1.0])  # overlaps 2, 1/4 and a gap
    chain = Chain.plain(4)
    assert chain.overlap(displacement).tolist() == [2.0, 0.25, -0.25]
    assert chain.contact_force(chain.overlap(displacement), None) == pytest.approx(
        [2**1.5, 0.125, 0.0], rel=1e-15, abs=0
    )
    expected = [7 - 2**1.5, 2**1.5 - 0.125, 0.125, 0.0]
    assert chain.acceleration(displacement, 7.0) == pytest.approx(expected, rel=1e-15, abs=0)


def test_the_first_peaks_of_the_demo_scene(demo_reference: hc.Result) -> None:
    # Found by two solvers that are not part of this project, printed to 1e-6 N.
    peaks = [
        *(105.407030, 116.244387, 125.615554, 133.058614, 138.729185),
        *(142.923076, 145.953014, 148.097936, 149.587218, 150.601174),
    ]
    assert demo_reference.peak_force[:10] == pytest.approx(peaks, abs=5.1e-7)


def slope(steps: list[float], errors: list[float]) -> float:
    """Order of convergence: slope of the error over the step, both logarithmic."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def test_the_far_field_wave_has_the_exact_speed() -> None:
    scene = paper_scene("cosine", 0.5, 6.0, granules=400)
    legs = scene.schedule(METHODS["reference"].step * scene.units.time)
    peaks = simulate(scene, legs, REFERENCE).peaks
    speed = 100 / (peaks.time[298] - peaks.time[198])
    assert exact.solitary_wave().speed == pytest.approx(0.9055157764, abs=5e-11)
    # Measured 1e-13; the transition has died away by contact 200.
    assert speed / peaks.force[248] ** (1 / 6) == pytest.approx(0.9055157764, rel=1e-9, abs=0)


def constant_force(granules: int = 2) -> hc.Scene:
    """Return a constant force of 100 N as a pulse table."""
    chain = hc.Chain(granules, **STEEL)
    table = hc.PulseTable((0.0, 1e-3), (100.0, 100.0))
    return hc.Scene(chain, table, hc.Run(end_time=2e-4))


def test_two_granules_under_a_constant_force_peak_at_five_quarters() -> None:
    result = hc.Native("reference").run(constant_force())
    # r'' = 1 - 2 r^(3/2) in natural units has r'^2 = 2 (r - 4/5 r^(5/2)), 0 at r^(3/2) = 5/4.
    assert result.peak_force == pytest.approx([125.0], rel=1e-12, abs=0)


def test_a_peak_at_the_very_end_of_a_step_has_its_time() -> None:
    scene = constant_force()
    unit = scene.units.time

    def peak_time(end: float, steps: int) -> float:
        legs = (Leg(0.0, end * unit, steps, scene.ramps[0]),)
        return float(simulate(scene, legs, METHODS["reference"].walker).peaks.time[0])

    between = peak_time(4.0, 37)
    # Now the peak is where a step ends and the next begins; rounding decides in which it is found.
    for steps in (20, 30, 40, 50):
        # A peak is flat: its time is known to the root of rounding, and a step is 0.08 at least.
        assert peak_time(2 * between, steps) == pytest.approx(between, rel=1e-7, abs=0)


def pulse_table() -> hc.Scene:
    """A table that starts late, jumps at both ends and has a corner."""
    rows = hc.PulseTable((1e-5, 3e-5, 6e-5), (40.0, 100.0, 20.0))
    return hc.Scene(hc.Chain(9, **STEEL), rows)


@pytest.mark.parametrize(
    "walker",
    [
        *(Walker(SRKN_11B, *how) for how in ((), (1e-5, 32, 4.0))),
        Walker(VELOCITY_VERLET),
    ],
)
@pytest.mark.parametrize(
    "scene",
    [
        paper_scene("cosine-triangular", 2.0, 2.0, 20),
        paper_scene("triangular", 0.3, 4.0, 12),
        pulse_table(),
    ],
    ids=["LM 2", "LM 0.3", "table"],
)
def test_compiled_vs_numpy(scene: hc.Scene, walker: Walker) -> None:
    """Everything that a run finds, compiled and in NumPy: equal but for rounding."""
    legs, units = scene.schedule(0.1 * scene.units.time), scene.units
    times = np.linspace(0, scene.end_time / units.time, 7)
    recorders = [Recorder(times, scene.chain.granules) for _ in range(2)]
    ours = simulate(scene, legs, walker, recorders[0])
    plain = simulate_in_numpy(scene, legs, walker, recorders[1])
    assert ours.steps == plain.steps
    # Rounding errors of about 5,000 force evaluations; displacements of granules that flew off are
    # up to 60 units, velocities of histories are divided by steps of 0.1 and less.
    eps = float(np.finfo(np.float64).eps)
    pairs = [
        (ours.peaks.force, plain.peaks.force, 100),
        (ours.peaks.time, plain.peaks.time, 1000),
        (ours.displacement, plain.displacement, 5000),
        (ours.velocity, plain.velocity, 5000),
        (ours.work, plain.work, 100),
        (ours.momentum, plain.momentum, 100),
        (ours.energy, plain.energy, 200),
        (recorders[0].displacement, recorders[1].displacement, 5000),
        (recorders[0].velocity, recorders[1].velocity, 5000),
        (recorders[0].contact_force, recorders[1].contact_force, 200),
    ]
    for measured, expected, errors in pairs:
        assert measured == pytest.approx(expected, rel=0, abs=errors * eps)


@pytest.mark.parametrize(
    ("stepper", "steps"),
    [
        (VELOCITY_VERLET, [0.02, 0.01, 0.005]),
        (RungeKutta4(), [0.025, 0.0125, 0.00625]),
        (SRKN_11B, [0.2, 0.14, 0.1]),
    ],
    ids=["velocity-verlet", "rk4", "srkn-11b"],
)
def test_order_of_the_displacement(demo: hc.Scene, stepper: Stepper, steps: list[float]) -> None:
    # Before a contact opens: that spoils any order.
    scene = replace(demo, run=hc.Run(9 * demo.units.time))

    def displacement(step: float) -> Any:
        legs = scene.schedule(step * scene.units.time)
        if isinstance(stepper, RungeKutta4):
            return RungeKutta(scene, Deadline(60.0)).simulate(legs, Walker(stepper)).displacement
        return simulate(scene, legs, Walker(stepper)).displacement

    expected = simulate(scene, scene.schedule(0.02 * scene.units.time), Walker(SRKN_11B))
    errors = [float(np.max(np.abs(displacement(step) - expected.displacement))) for step in steps]
    # The higher orders have terms of still higher order at such steps.
    assert stepper.order - 0.05 < slope(steps, errors) < stepper.order + 0.5


@pytest.mark.parametrize(("place", "moment"), [(threading.Thread, "start"), (simulation, "_wait")])
def test_an_interrupt_stops_a_run(place: Any, moment: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The interrupt comes while the thread starts, or while the main thread waits for it."""
    control = np.zeros(3)
    stopped = threading.Event()

    def work() -> None:
        while control[0] == 0:
            time.sleep(0.01)
        stopped.set()

    original = getattr(place, moment)

    def interrupted(*given: Any) -> None:
        monkeypatch.undo()
        if moment == "start":
            original(*given)
        raise KeyboardInterrupt

    monkeypatch.setattr(place, moment, interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            stoppable(work, control, Deadline(60.0))
        assert control[0] == -1
        assert stopped.is_set()
    finally:
        control[0] = -1


def test_a_failure_in_a_long_run_is_not_lost() -> None:
    def work() -> None:
        raise MemoryError("none left")

    with pytest.raises(MemoryError, match="none left"):
        stoppable(work, np.zeros(2), Deadline(60.0))


@pytest.mark.parametrize(
    "kernel",
    [elastic.march, damped_kernel.march, verlet.take_steps, elastic.march_each],
    ids=lambda kernel: kernel.py_func.__module__,
)
def test_a_kept_kernel_is_forgotten_when_a_module_changes_that_it_calls(kernel: Any) -> None:
    """Also one that it imports by another; Numba itself sees changes in its own file alone."""
    home = kernel.py_func.__module__
    used, waiting = set[str](), [home]
    while waiting:
        used.add(name := waiting.pop())
        tree = ast.parse(Path(str(sys.modules[name].__file__)).read_text(encoding="utf-8"))
        imports = {str(node.module) for node in tree.body if isinstance(node, ast.ImportFrom)}
        rooms = ("hertzchain.engines.native.", "hertzchain.observables.")
        imports = {name for name in imports if name.startswith(rooms)}
        waiting += imports - used
    assert {home, "hertzchain.observables.compiling"} < used
    stamp = kernel._cache._cache_file._source_stamp
    for name in used:
        path = Path(str(sys.modules[name].__file__))
        file = path.stat()
        assert (path.name, file.st_mtime, file.st_size) in stamp, name
