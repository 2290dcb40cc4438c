"""Make the map of peak forces that `hertzchain predict` reads: 112,000 simulations, 4 minutes."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.files import check_writable, write_with
from hertzchain.scene.shocks import PROFILES, profile_named
from hertzchain.theory import peak_map
from validation.script import leave_with, progress

GRANULES = 120
"""The free end is out of reach of contact 80. Contact 118 stands for the far field: at LM_ratio 10
and n 2, the slowest of all, its peak is 4e-6 below those farther on."""

CHAIN = hc.Chain(GRANULES, radius=5e-3, young_modulus=2e11, poisson_ratio=0.3, density=7800.0)
"""An arbitrary chain: by similarity the peaks are the same for all."""


def node(profile: str, momentum_ratio: float, duration_ratio: float) -> FloatArray:
    """ln(F / F0) of contacts 2 to 80 and of the far field, right to 1e-6, shape (80,)."""
    pulse = hc.Pulse(profile_named(profile), 1.0, duration_ratio, momentum_ratio=momentum_ratio)
    result = hc.Native(rtol=1e-6, peaks_only=True).run(hc.Scene(CHAIN, pulse))
    far = result.solitary_wave.far_field_force
    assert far is not None
    assert result.peak_passed.all()
    forces = np.append(result.peak_force[: peak_map.LAST_CONTACT - 1], far)
    return np.asarray(np.log(forces), np.float64)


def encode(values: FloatArray) -> NDArray[np.int32]:
    """Return the numbers of the file for a grid: see hertzchain.theory.peak_map.

    The values are ln(F / F0), shape (LM_ratio, n, columns). Values within a step of the prediction
    count as 0, so that smooth regions take no space; the next prediction starts from the values
    that the reader will have, so that errors do not add up.
    """
    target = np.moveaxis(values, 2, 0)
    spacing = 2**5
    coarse = np.rint(target[:, ::spacing, ::spacing] / peak_map.STEP)
    pieces = [coarse]

    def correct(predicted: FloatArray, where: tuple[slice, ...]) -> FloatArray:
        left = (target[where] - predicted) / peak_map.STEP
        counts = np.where(np.abs(left) < 1, 0.0, np.rint(left))
        pieces.append(counts)
        return predicted + peak_map.STEP * counts

    peak_map.refine(peak_map.STEP * coarse, correct)
    return np.concatenate([piece.ravel() for piece in pieces]).astype(np.int32)


def simulated(profile: str) -> FloatArray:
    """ln(F / F0) on the whole grid, shape (LM_ratio, n, columns)."""
    momentum_ratio, duration_ratio = peak_map.grid()
    rows = progress(momentum_ratio.tolist(), profile)
    return np.array([[node(profile, ratio, n) for n in duration_ratio.tolist()] for ratio in rows])


def run() -> bool:
    """Write the map."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=peak_map.FILE, help="where to")
    output = parser.parse_args().output
    check_writable(output)
    counts = {}
    for profile in PROFILES:
        counts[profile] = encode(simulated(profile))
        print(f"{profile}: {np.count_nonzero(counts[profile])} counts", file=sys.stderr)
    write_with(
        output,
        lambda path: np.savez_compressed(path, **counts),  # type: ignore[arg-type]  # names
    )
    return True


if __name__ == "__main__":
    leave_with(run)
