"""Maps of sweeps: cells of a grid, or points of a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.colors import BoundaryNorm, LogNorm

import hertzchain as hc
from hertzchain.sweeps.drawing import cell_edges, draw
from tests.sweeps.made import BASE, F_SW, LAMMPS, RATIO, N, P

# Maps


def test_the_cells_of_a_map_are_what_the_table_has(grid: hc.Sweep) -> None:
    drawn = draw(grid, RATIO, N, F_SW)
    axes, bar = drawn.figure.axes
    mesh: Any = axes.collections[0]
    cells = np.asarray(mesh.get_array()).reshape(3, 5)
    wanted = grid.to_frame().pivot_table(index=N, columns=RATIO, values=F_SW)
    np.testing.assert_array_equal(cells, wanted)
    x, y = mesh.get_coordinates()[0, :, 0], mesh.get_coordinates()[:, 0, 1]
    ratio = wanted.columns.to_numpy()
    np.testing.assert_allclose(x[1:-1], np.sqrt(ratio[1:] * ratio[:-1]), rtol=1e-14)
    np.testing.assert_array_equal(y, [1, 3, 6.5, 11.5])
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert (axes.get_xlabel(), axes.get_ylabel(), bar.get_ylabel()) == ("LM_ratio", "n", "F_SW [N]")
    assert axes.get_legend() is None
    assert drawn.remarks == ()


def test_whole_numbers_have_a_colour_each(grid: hc.Sweep) -> None:
    (mesh,) = grid.plot(RATIO, N, P).axes[0].collections
    p = grid.to_frame()[P]
    assert isinstance(mesh.norm, BoundaryNorm)
    assert list(mesh.norm.boundaries) == list(np.arange(p.min() - 0.5, p.max() + 1))


def test_a_map_of_a_sample_is_points(sampled: hc.Sweep) -> None:
    drawn = draw(sampled, RATIO, N, "overlap_ratio", {"shock.profile": "cosine"})
    axes, _ = drawn.figure.axes
    (points,) = axes.collections
    table = sampled.to_frame()
    table = table[table["shock.profile"] == "cosine"]
    np.testing.assert_array_equal(points.get_offsets(), table[[RATIO, N]])
    np.testing.assert_array_equal(points.get_array(), table["overlap_ratio"])
    assert not isinstance(points.norm, LogNorm)
    assert axes.get_xscale() == "log"
    assert drawn.remarks == ()


@pytest.mark.lammps
def test_several_values_in_one_place_of_a_map_are_refused(
    both: hc.Sweep, grid: hc.Sweep, sampled: hc.Sweep
) -> None:
    with pytest.raises(hc.HertzchainError, match=r"one place .*--where shock.profile="):
        draw(sampled, RATIO, N, F_SW)
    vary = {RATIO: "0.1,2", N: "4,2", "chain.radius": "1 mm,5 mm"}
    swept = hc.sweep(BASE, vary, backends=["native", LAMMPS])
    with pytest.raises(hc.HertzchainError, match=r"chain.radius and backend vary, too, .* place"):
        draw(swept, RATIO, N, "speed_m_s")
    where = {"chain.radius": "1 mm", "backend": "native"}
    (mesh,) = draw(swept, RATIO, N, "speed_m_s", where).figure.axes[0].collections
    cells = np.asarray(mesh.get_array())
    table = swept.to_frame()
    own = table[(table["backend"] == "native") & (table["chain.radius"] == 1e-3)]
    np.testing.assert_array_equal(np.sort(np.ravel(cells)), np.sort(own["speed_m_s"]))
    with pytest.raises(hc.HertzchainError, match="varies, which makes a map: name the column"):
        draw(grid, RATIO, N)
    with pytest.raises(hc.HertzchainError, match="name the column of numbers"):
        draw(both, F_SW, RATIO, "backend")


def test_a_sample_met_by_a_grid_is_no_map() -> None:
    vary = {RATIO: "0.1:2:log", N: "2,3", "chain.radius": "1 mm,5 mm"}
    swept = hc.sweep(BASE, vary, samples=3)
    with pytest.raises(hc.HertzchainError, match=f"take {RATIO} as --x or --y"):
        draw(swept, N, "chain.radius", F_SW)


@pytest.mark.parametrize(
    ("values", "log", "edges"),
    [
        ([1, 10, 100], True, [10**-0.5, 10**0.5, 10**1.5, 10**2.5]),
        ([1, 2, 4], False, [0.5, 1.5, 3, 5]),
        ([1, 5], False, [0, 3, 7]),  # nothing is below 0
        ([-1, 0, 1], False, [-1.5, -0.5, 0.5, 1.5]),
    ],
)
def test_edges_are_half_way(values: list[float], log: bool, edges: list[float]) -> None:
    np.testing.assert_allclose(cell_edges(np.array(values, float), log), edges, rtol=1e-14)
