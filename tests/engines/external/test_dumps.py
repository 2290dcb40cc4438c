"""Dump files of LAMMPS and its kin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hertzchain.engines.external.dumps import read_blocks, read_frames
from hertzchain.errors import RunFailed

FRAME = """ITEM: TIMESTEP
{step}
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS ss ff ff
0 1
0 1
0 1
ITEM: ATOMS x id vx
0.25 2 -1e-300
{x:.17g} 1 2
0.75 3 3
"""


def test_frames_in_the_order_of_the_ids(tmp_path: Path) -> None:
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1) + FRAME.format(step=20, x=1 / 3))
    steps, values = read_frames(path, ("vx", "x"))
    assert steps.tolist() == [0, 20]
    assert values[1].tolist() == [[2, -1e-300, 3], [1 / 3, 0.25, 0.75]]
    assert values.shape == (2, 2, 3)
    assert np.array_equal(values[0, 1], [0.1, 0.25, 0.75])


def test_blocks_hold_so_many_frames(tmp_path: Path) -> None:
    path = tmp_path / "a.dump"
    path.write_text("".join(FRAME.format(step=k, x=k / 7) for k in range(5)))
    blocks = list(read_blocks(path, ("x",), frames=2))
    assert [steps.tolist() for steps, _ in blocks] == [[0, 1], [2, 3], [4]]
    assert [values[:, 0, 0].tolist() for _, values in blocks] == [
        [0, 1 / 7],
        [2 / 7, 3 / 7],
        [4 / 7],
    ]
    path.write_text(path.read_text()[:-4])
    blocks_left = read_blocks(path, ("x",), frames=2)
    next(blocks_left), next(blocks_left)
    with pytest.raises(RunFailed, match="cut off"):
        next(blocks_left)


@pytest.mark.parametrize("lost", ["0.75 3 3\n", "id vx\n0.25", "ITEM"])
def test_a_damaged_dump_is_one_sentence(tmp_path: Path, lost: str) -> None:
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1).partition(lost)[0])
    with pytest.raises(RunFailed, match=r"^a\.dump: "):
        read_frames(path, ("x",))


def test_a_dump_that_is_not_there_or_has_other_columns(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="no dump"):
        read_frames(tmp_path / "b.dump", ("x",))
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1))
    with pytest.raises(RunFailed, match="other columns"):
        read_frames(path, ("fx",))
