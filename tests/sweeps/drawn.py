"""What tests of pictures of sweeps share."""

from __future__ import annotations

from typing import Any

import numpy as np

import hertzchain as hc
from tests.conftest import paper_scene

BASE = paper_scene("cosine", 1.0, 4.0, granules=12)
RATIO, N, P = "shock.momentum_ratio", "shock.duration_ratio", "transition_granules"
F_SW = "solitary_wave_force_N"
LAMMPS = hc.Lammps(rtol=1e-3)  # sees the p and the order of the lines that native sees


def drawn_lines(figure: Any) -> list[tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]]:
    return [line.get_data() for line in figure.axes[0].lines]


def legend(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]
