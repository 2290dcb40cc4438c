"""The speed of two commits: how it is judged, and that nothing is left behind."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from hertzchain.errors import RunFailed
from validation import bench_before
from validation.bench_before import (
    Compared,
    NoCommit,
    by_turns,
    checked_out,
    find_commit,
    is_same,
    judge,
    slower,
    workers,
)


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


# Commits


def git(folder: Path, *arguments: str) -> str:
    named = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "init.defaultBranch=main"]
    command = ["git", "-C", str(folder), *named, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A clone with two commits, of which the second changed hertzchain/."""
    if shutil.which("git") is None:
        pytest.skip("needs git")
    root = tmp_path / "clone"
    (root / "hertzchain").mkdir(parents=True)
    git(root, "init", "--quiet")
    for text in ("old", "new"):
        (root / "hertzchain" / "a.py").write_text(f"# {text}\n", encoding="utf-8")
        git(root, "add", ".")
        git(root, "commit", "--quiet", "-m", text)
    return root


def test_the_commit_before_is_there_for_a_while(clone: Path) -> None:
    with checked_out(find_commit("HEAD~1", clone), clone) as tree:
        assert (tree / "hertzchain" / "a.py").read_text(encoding="utf-8") == "# old\n"
    trees = []

    def interrupted() -> None:
        with checked_out("HEAD", clone) as tree:
            git(clone, "worktree", "lock", str(tree))  # as while git checks it out
            trees.append(tree)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not tree.parent.exists()
    assert not trees[0].parent.exists()
    assert len(git(clone, "worktree", "list").splitlines()) == 1


def test_only_what_the_package_changed_is_measured(clone: Path) -> None:
    (clone / "README.md").write_text("more", encoding="utf-8")
    git(clone, "add", ".")
    assert is_same("HEAD", clone)
    assert not is_same("HEAD~1", clone)
    (clone / "hertzchain" / "a.py").write_text("# newer\n", encoding="utf-8")
    assert not is_same("HEAD", clone)


def test_a_commit_that_is_not_there_is_one_sentence(
    clone: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for revision, folder, words in (
        ("HEAD~2", clone, r"^HEAD~2 is not a commit of this clone; name another"),
        ("HEAD", clone / "hertzchain", "is not a git clone"),
        ("HEAD", tmp_path, "not a git repository"),
    ):
        with pytest.raises(NoCommit, match=words):
            find_commit(revision, folder)
    monkeypatch.delenv("CI", raising=False)
    for ci, status in ((False, 2), (True, 0)):
        if ci:
            monkeypatch.setenv("CI", "true")
        assert bench_before.run(["--revision", "no-such-commit"]) == status
        out, err = capsys.readouterr()
        assert (out.startswith("bench_before.py: skipped: "), err == "") == (ci, ci)


@pytest.mark.parametrize("ratio", [1.15, 1.3])
def test_the_last_line_is_the_verdict(
    ratio: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench_before, "find_commit", lambda _: "0" * 40)
    monkeypatch.setattr(bench_before, "is_same", lambda _: False)
    monkeypatch.setattr(bench_before, "checked_out", contextlib.nullcontext)
    measured = {"demo": with_ratio(ratio)}, {"batch": "AttributeError: no such function"}
    monkeypatch.setattr(bench_before, "compare", lambda _tree, _limit: measured)
    is_slower = ratio > 1.2
    assert bench_before.run(["--revision", "v0.1.0", "--limit", "1.2"]) == is_slower
    out, err = capsys.readouterr()
    assert "new / old: the median of the ratios of paired turns" in out
    begin = "bench_before.py: measuring, about two minutes\n"
    slow = "bench_before.py: slower than v0.1.0: demo: 1.30 times\n"
    assert err == begin + slow * is_slower
    verdict = "bench_before.py: no workload is more than 1.2 times slower than v0.1.0"
    assert (out.splitlines()[-1] == verdict) != is_slower


# Two trees


def test_trees_that_cannot_be_measured(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="no package hertzchain"), workers([tmp_path]):
        pass
    package = tmp_path / "hertzchain"
    package.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    with workers([tmp_path, tmp_path]) as both:
        both[0].ask("no such workload")
        with pytest.raises(RunFailed, match="ended with status 1"):
            both[0].answer()
    assert all(worker.status is not None for worker in both)
