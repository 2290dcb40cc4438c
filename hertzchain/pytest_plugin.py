"""A fixture for the tests of other projects: their peaks, judged by the native reference.

pytest loads this module in every project that has hertzchain installed, so nothing is imported here
that pytest has not already loaded.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from hertzchain.scene.scene import Scene
    from hertzchain.verdict.judgement import Judgement


@pytest.fixture
def judge_peaks(request: pytest.FixtureRequest) -> Callable[..., Judgement]:
    """Fail the test unless peaks from any code are those of a scene; see ``hertzchain.judge``.

    judge_peaks(scene, peak_force, *, tolerance=1e-3, dt=None)

    Parameters
    ----------
    scene
        A scene, or the path of its file. Paths are relative to the folder of the test's file.
    peak_force
        Peak forces [N] of contacts 2 ... N, and N + 1 at a wall: the path of a CSV file with the
        columns contact and peak_force_N, a mapping from contacts, or an array of shape (contacts,)
        with NaN for missing peaks; or any other file that ``hertzchain.judge`` takes.
    tolerance
        Largest relative difference that passes.
    dt
        Step of the code [s], if known.

    Returns
    -------
    A function that returns the ``hertzchain.Judgement`` where the peaks pass.
    """
    folder = request.path.parent

    def judge_peaks(
        scene: Scene | Path | str,
        peak_force: Path | str | Mapping[int, float] | ArrayLike,
        *,
        tolerance: float | None = None,
        dt: float | None = None,
    ) -> Judgement:
        __tracebackhide__ = True
        from hertzchain.errors import HertzchainError
        from hertzchain.limits import TOLERANCE
        from hertzchain.verdict.results import judge

        try:
            chosen = folder / scene if isinstance(scene, str | os.PathLike) else scene
            given = folder / peak_force if isinstance(peak_force, str | os.PathLike) else peak_force
            wanted = TOLERANCE if tolerance is None else tolerance
            judgement = judge(chosen, given, tolerance=wanted, dt=dt)
        except HertzchainError as unusable:
            problem = f"hertzchain: {unusable}"
        else:
            if judgement.verdict == "pass":
                return judgement
            problem = f"hertzchain: {judgement.summary}\n\n{_printed(judgement)}"
        pytest.fail(problem)

    return judge_peaks


def _printed(judgement: Judgement) -> str:
    """Return the text that the command line prints for a judgement, without colours."""
    from hertzchain.report.console import plain_text, print_document
    from hertzchain.report.contents import of_judgement

    document = of_judgement(judgement)
    return plain_text(lambda console: print_document(console, document, "not shown"), width=100)
