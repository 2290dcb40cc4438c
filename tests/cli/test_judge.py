"""``hertzchain judge``: output, files, status and refusals."""

from __future__ import annotations

from pathlib import Path

from tests.cli.short_chain import CONTACTS, embedded, rows_of, scene_file
from tests.command_line import Command, Outcome
from tests.oracles.json_schema import problems
from tests.processes import names

JUDGE = ("judge", "scene.toml", "peaks.csv")


def peaks_file(native: Outcome, factor: float = 1.0) -> None:
    rows = enumerate(native.json()["peak_force_N"], start=2)
    lines = ["contact,peak_force_N", *(f"{contact},{factor * force!r}" for contact, force in rows)]
    Path("peaks.csv").write_text("\n".join(lines) + "\n")


def test_peaks_from_a_file_are_judged(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native)
    outcome = hertzchain(*JUDGE, "--plot", "plot.png")
    assert (outcome.status, outcome.err) == (0, "Plot written to plot.png\n")
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert [row[0] for row in rows_of(outcome.out)] == ["2", "3", "4", "5", "6"]
    assert "11 judged, 0 failed, 0 not given" in outcome.out
    assert "cause" not in outcome.out
    assert outcome.out.endswith("Verdict: pass\n")


def test_wrong_peaks_are_status_1_with_a_cause(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native, 1e-3)
    outcome = hertzchain(*JUDGE, "--dt", "20 ns")
    assert outcome.status == 1
    assert "Likely cause: every peak 0.001 times the true one: in units of kN" in " ".join(
        outcome.out.split()
    )
    assert "velocity Verlet, steps of 2e-08 s" in outcome.out
    assert outcome.out.endswith("Verdict: fail\n")
    outcome = hertzchain(*JUDGE, "--json", "--tolerance", "0.5", "--report", "report.html")
    assert (outcome.status, outcome.err) == (1, "Report written to report.html\n")
    assert names() == ["peaks.csv", "report.html", "scene.toml"]
    page, document = Path("report.html").read_text("utf-8"), outcome.json()
    assert embedded(page) == document
    assert "scene.toml</b> and <b>peaks.csv" in page
    assert document["verdict"] == "fail"
    assert document["tolerance"] == 0.5
    assert "in units of kN" in document["cause"]
    assert problems(document, "judge.json") == []
    assert [row["contact"] for row in document["rows"]] == list(range(2, 2 + CONTACTS))


def test_peaks_of_a_damped_scene_are_judged(hertzchain: Command, native: Outcome) -> None:
    """Those of the elastic scene lack its damping."""
    scene_file()
    peaks_file(native)
    with Path("scene.toml").open("a") as file:
        file.write('\n[contact]\ndamping = "dashpot"\ncoefficient = 5.0\n')
    outcome = hertzchain(*JUDGE, "--report", "report.html", "--dt", "20 ns")
    assert outcome.status == 1
    said = " ".join(outcome.out.split())
    assert "Likely cause: no damping; leaves" in said
    assert "What velocity Verlet has at that step is not known of damped contacts." in said
    assert "Causes that were tried in a scene with damping: " in said
    assert "no damping" in Path("report.html").read_text("utf-8")
