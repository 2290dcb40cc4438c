"""Runs of one scene, sampled and written as other codes do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.verdict.results import Motion
from tests.conftest import STEEL

N = 12
SCENE = hc.Scene(hc.Chain(N, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5), hc.Run(4e-4))
DT = 1e-7


@dataclass(frozen=True, eq=False)
class Samples:
    """A run of native, sampled: what files of other codes hold."""

    time: FloatArray
    position: FloatArray
    net_force: FloatArray


def sampled(scene: hc.Scene, apart: float, phase: float = 0.0) -> Samples:
    """Samples so far apart in natural time units."""
    unit = scene.units.time
    time = np.arange(phase * apart * unit, scene.end_time, apart * unit)
    history = hc.Native(rtol=1e-9).run(scene, record=time).history
    force = history.contact_force
    net = np.broadcast_to(scene.granules.constant_force, history.displacement.shape).copy()
    net[:, 0] += scene.applied_force(time)
    net[:, :-1] -= force[:, : scene.chain.granules - 1]
    net[:, 1:] += force[:, : scene.chain.granules - 1]
    if scene.wall is not None:
        net[:, -1] -= force[:, -1]
    position = scene.granules.position + history.displacement
    return Samples(time, position, net)


def off(peak_force: FloatArray, true: FloatArray) -> FloatArray:
    """Relative differences of the peaks that count."""
    counts = true > 1e-3 * true.max()
    return np.asarray(np.abs(peak_force[counts] / true[counts] - 1))


def motion(run: Samples) -> Motion:
    return Motion(run.time, True, run.net_force)


GRAVITY = hc.Precompression(gravity=9.81)
RESTITUTION = hc.Contact("restitution", restitution=0.9)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-7)
TERMS = {
    "striker on a wall": hc.Scene(SCENE.chain, hc.Striker(1.0), SCENE.run, wall=hc.Wall("rigid")),
    "pressed": replace(SCENE, precompression=hc.Precompression(force=20.0)),
    "column": replace(SCENE, wall=hc.Wall("same"), precompression=GRAVITY),
    "damped": replace(SCENE, contact=RESTITUTION),
    "damped, with a wall": replace(SCENE, contact=VISCOELASTIC, wall=hc.Wall("same")),
}


HEAD = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n12\nITEM: BOX BOUNDS f f f\n0 1\n0 1\n0 1\n"


def dump_of(run: Samples, beside: FloatArray | float = 0.0) -> list[str]:
    """Frames of a dump with times, and with some granules beside the others [m]."""
    across = np.broadcast_to(beside, N)
    return [
        f"ITEM: TIME\n{run.time[step]:.15g}\n"
        + HEAD.replace("\n0\n", f"\n{step}\n", 1)
        + "ITEM: ATOMS id x y fx\n"
        + "".join(
            f"{k + 1} {run.position[step, k]:.15g} {across[k]:.15g} {run.net_force[step, k]:.15g}\n"
            for k in range(N)
        )
        for step in range(run.time.size)
    ]


def deck(folder: Path, axis: str = "x", sign: int = 1) -> str:
    """A run of the scene that writes every kind of file."""
    along = [direction == axis for direction in "xyz"]
    texts = {
        "FOLDER": str(folder), "AXIS": axis, "PUSH": str(sign * 100),
        "PLACE": " ".join(f"$({sign}*(v_i-1)*0.0095)" if is_along else "0" for is_along in along),
        "FORCE": " ".join("v_push" if is_along else "0.0" for is_along in along),
    }  # fmt: skip
    text = Path(__file__).with_name("in.sampled").read_text(encoding="utf-8")
    for name, value in texts.items():
        text = text.replace(name, value)
    return text
