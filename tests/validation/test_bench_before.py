"""The speed of two commits: how it is judged, and that nothing is left behind."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

import pytest

from hertzchain.errors import RunFailed
from validation import bench_before
from validation.bench_before import ROOT, Compared, Worker, by_turns, judge, slower


def with_ratio(ratio: float) -> Compared:
    return Compared(1.0, ratio, ratio)


@pytest.mark.parametrize(
    ("ratios", "is_slower", "lowest"),
    [
        ([1.15], False, 1.15),
        ([1.3, 1.16, 1.2], True, 1.16),  # slower in each of three measurements
        ([1.5, 1.1], False, 1.1),
        ([1.5, 1.5, 1.1], False, 1.1),
    ],
)
def test_what_is_slower_three_times_is_slower(
    ratios: list[float], is_slower: bool, lowest: float
) -> None:
    asked: list[Sequence[str]] = []

    def measure(names: Sequence[str], attempt: int) -> dict[str, Compared]:
        asked.append(names)
        planted = {"demo": ratios[attempt], "batch": 1.0}
        return {name: with_ratio(planted[name]) for name in names}

    found = judge(measure, ["demo", "batch"], 1.15)
    assert found == {"demo": with_ratio(lowest), "batch": with_ratio(1.0)}
    assert slower(found, 1.15) == ["demo"] * is_slower
    assert asked == [["demo", "batch"], *[["demo"]] * (len(ratios) - 1)]
    assert slower({"demo": with_ratio(float("nan"))}) == ["demo"]


def test_both_take_turns_and_the_ratio_is_the_median_of_turns() -> None:
    clock = iter(range(1, 7))
    # Turn by turn the new tree is asked first, second and first.
    assert by_turns([lambda: next(clock)] * 2, 3) == [(2, 1), (3, 4), (6, 5)]
    # A load that slows two turns, in both trees alike.
    compared = Compared.of([(1.0, 1.2), (5.0, 6.0), (10.0, 9.0)])
    assert (compared.old, compared.new, compared.ratio) == (5.0, 6.0, 1.2)


@pytest.mark.parametrize("ratio", [1.15, 1.3])
def test_the_last_line_is_the_verdict(
    ratio: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench_before, "find_commit", lambda _: None)
    monkeypatch.setattr(bench_before, "is_same", lambda _: False)
    monkeypatch.setattr(bench_before, "checked_out", contextlib.nullcontext)
    measured = {"demo": with_ratio(ratio)}, {"batch": "AttributeError: no such function"}
    monkeypatch.setattr(bench_before, "compare", lambda _tree, _limit: measured)
    is_slower = ratio > 1.2
    assert bench_before.run(["--revision", "v0.1.0", "--limit", "1.2"]) == is_slower
    out, err = capsys.readouterr()
    assert "new / old: the median of the ratios of paired turns" in out
    begin = "measuring, about two minutes\n"
    slow = "slower than v0.1.0: demo: 1.30 times\n"
    assert err == begin + slow * is_slower
    verdict = "no workload is more than 1.2 times slower than v0.1.0"
    assert (out.splitlines()[-1] == verdict) != is_slower


def test_what_cannot_be_compared_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(bench_before, "ROOT", ROOT / "hertzchain")
    assert bench_before.run([]) == 2
    assert "git" in capsys.readouterr().err
    monkeypatch.setenv("PATH", str(tmp_path))
    assert bench_before.run([]) == 2
    err = capsys.readouterr().err
    assert err.endswith("install git to compare commits\n")
    assert err.count("\n") == 1


def test_a_worker_that_has_ended_is_reported(tmp_path: Path) -> None:
    """Its pipe is broken when it is asked."""
    package = tmp_path / "hertzchain"
    package.mkdir()
    (package / "__init__.py").write_text("raise SystemExit(3)", encoding="utf-8")
    worker = Worker(tmp_path)
    try:
        with pytest.raises(RunFailed, match="ended with status 3"):
            worker.answer()
        with pytest.raises(RunFailed, match="ended with status 3"):
            worker.turn("demo")
    finally:
        worker.end()
