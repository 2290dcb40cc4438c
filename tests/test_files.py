"""Files appear whole or not at all."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from hertzchain.errors import OutputError
from hertzchain.files import check_writable, write_text, write_texts, write_with
from tests.processes import linux, names


def test_a_new_file_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("a much longer old text")
    with path.open() as reader:
        thread = threading.Thread(target=write_text, args=(str(path), "new"))
        thread.start()
        thread.join()
        assert reader.read() == "a much longer old text"
    assert path.read_text() == "new"
    write_text(path, "größer\nals\n")
    assert path.read_bytes() == "größer\nals\n".encode()
    assert names(tmp_path) == ["a.txt"]
    (tmp_path / "usual").touch()
    assert path.stat().st_mode == (tmp_path / "usual").stat().st_mode


@pytest.mark.parametrize("problem", [KeyboardInterrupt, ValueError, MemoryError, SystemExit])
def test_a_write_that_fails_midway_leaves_the_old_file(
    tmp_path: Path, problem: type[BaseException]
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def write(part: Path) -> None:
        part.write_text("half of the n")
        raise problem

    with pytest.raises(problem):
        write_with(path, write)
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_another_may_write_to_the_same_place_meanwhile(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"

    def write(part: Path) -> None:
        part.write_text("half of a")
        write_text(path, "b")
        assert (part.read_text(), path.read_text()) == ("half of a", "b")
        part.write_text("a")

    write_with(path, write)
    assert path.read_text() == "a"
    assert names(tmp_path) == ["a.txt"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "is a directory, must be the name of a file"),
        ("file/a.txt", r"a\.txt: cannot be written"),
        ("file/no/a.txt", r"a\.txt: cannot be written"),
        ("x" * 300, "x: "),
        (f"{'x' * 300}/a.txt", r"a\.txt: "),
        ("x\0y", "x"),
        pytest.param("/proc/nope", "/proc/nope: ", marks=linux),
    ],
    ids=lambda text: text[:12],
)
def test_what_cannot_be_written_is_an_error(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=words):
        write_text(tmp_path / name, "a")
    if not name.startswith("/proc"):  # nobody knows before
        with pytest.raises(OutputError, match=words):
            check_writable(tmp_path / name)
    check_writable(tmp_path / "a.txt")
    assert names(tmp_path) == ["file"]


@linux
def test_a_device_is_written_to_and_not_replaced() -> None:
    with pytest.raises(OutputError, match=r"/dev/full: cannot be written \(No space left"):
        write_text("/dev/full", "a")
    write_text("/dev/null", "a")
    assert Path("/dev/null").is_char_device()


def test_a_full_disk_leaves_nothing(full_disk: Path) -> None:
    with pytest.raises(OutputError, match=r"a\.txt: cannot be written \(No space left"):
        write_text(full_disk / "a.txt", "a")
    assert names(full_disk) == ["filler"]


def test_of_files_that_belong_together_none_is_written_without_the_others(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(OutputError, match=r"b\.txt: is a directory"):
        write_texts({tmp_path / "a.txt": "a", tmp_path / "b.txt": "b"})
    assert names(tmp_path) == ["b.txt"]
    write_texts({tmp_path / "a.txt": "a", tmp_path / "c.txt": "c"})
    assert names(tmp_path) == ["a.txt", "b.txt", "c.txt"]
    assert (tmp_path / "c.txt").read_text() == "c"


def test_a_link_to_another_file_system_is_followed(tmp_path: Path, full_disk: Path) -> None:
    (full_disk / "filler").unlink()
    (tmp_path / "link.txt").symlink_to(full_disk / "a.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (full_disk / "a.txt").read_text() == "new"
    assert (tmp_path / "link.txt").is_symlink()
    assert names(full_disk) == ["a.txt"]
    assert names(tmp_path) == ["disk", "link.txt"]
    (tmp_path / "lost.txt").symlink_to(tmp_path / "no" / "a.txt")
    write_text(tmp_path / "lost.txt", "in a new folder")
    assert (tmp_path / "no" / "a.txt").read_text() == "in a new folder"
