"""Files of all layouts are read, and all faults of a file are reported at once."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hertzchain.errors import HertzchainError
from hertzchain.pulses.recording import Recording, read_recording

TIME = [k * 0.5 for k in range(10)]  # [ms] or [s]
FORCE = [0.25 * k for k in range(10)]


def written(path: Path, line: str, header: str = "", comma: bool = False) -> Path:
    """A file with rows of a format of {t} and {f}."""
    rows = [line.format(t=t, f=f) for t, f in zip(TIME, FORCE, strict=True)]
    text = "\n".join(row.replace(".", ",") if comma else row for row in rows)
    path.write_text(header + text + "\n", encoding="utf-8")
    return path


def assert_read(recording: Recording, time: float = 1.0, force: float = 1.0) -> None:
    """Assert the times and forces of ``written`` in other units: products of two are rounded."""
    np.testing.assert_allclose(recording.time, np.array(TIME) * time, rtol=1e-15)
    np.testing.assert_allclose(recording.force, np.array(FORCE) * force, rtol=1e-15)


@pytest.mark.parametrize(
    ("line", "header", "comma"),
    [
        ("{t},{f}", "", False),
        ("{t},{f}", "time_s,force_N\n", False),
        ("{t};{f}", "", False),
        ("{t};{f}", "", True),
        ("{t};{f};", "", True),
        ("{t}\t{f}", "", False),
        ("{t}\t{f}", "", True),
        ("{t} {f}", "", False),
        ("  {t}    {f}  ", "", True),
        ('"{t}","{f}"', '"Time","Force"\n', False),
        ("{t}, {f}", "# a comment\n% another\n\n", False),
        ("{t};{f}", "; a comment\n", False),
        ("{t:e};{f:e}", "", True),
        ("{t},{f} # remark", "", False),
        ("{t},{f},9.5,text", "Time,Force,CH2,State\n", False),
        ("{t};{f}", "Model;3;4,5\nInterval;0,5\nTime;Force\n", True),
        ("{t},{f}", "\ufeff", False),
    ],
)
def test_a_layout_is_told_from_the_file(
    line: str, header: str, comma: bool, tmp_path: Path
) -> None:
    assert_read(read_recording(written(tmp_path / "a.csv", line, header, comma)))


def test_encodings_and_ends_of_lines(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "{t},{f}", "Zeit [µs],Kraft [N]\n")
    text = path.read_text(encoding="utf-8")
    for encoding, end in (("utf-16", "\n"), ("latin-1", "\n"), ("utf-8", "\r\n"), ("utf-8", "\r")):
        path.write_bytes(text.replace("\n", end).encode(encoding))
        assert_read(read_recording(path), time=1e-6)


@pytest.mark.parametrize(
    ("header", "time", "force"),
    [
        ("Time [ms],Force [kN]", 1e-3, 1e3),
        ("t/ms,F / kN", 1e-3, 1e3),
        ("t (us),F (mN)", 1e-6, 1e-3),
        ("time_ns,force_N", 1e-9, 1.0),
        ("Time,Load\nms,N", 1e-3, 1.0),
        ("Time,Load\n[ms],[kN]", 1e-3, 1e3),
        ("Time,Load\nSecond,Newton", 1.0, 1.0),
        ("# Time [ms], Force [kN]", 1e-3, 1e3),
        ("% time [us], force [kN]", 1e-6, 1e3),
    ],
)
def test_units_of_the_header(header: str, time: float, force: float, tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "{t},{f}", header + "\n")
    assert_read(read_recording(path), time, force)


def test_units_and_scale_of_options(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "{t},{f}", "time_ms,force_kN\n")
    assert_read(read_recording(path, time_unit="us"), 1e-6, 1e3)
    assert_read(read_recording(path, scale=-2e3), 1e-3, -2e3)
    with pytest.raises(HertzchainError, match=r"^--time-unit = .*wrong dimension"):
        read_recording(path, time_unit="N")
    with pytest.raises(HertzchainError, match=r"^--time-unit = .*must be a unit such as s"):
        read_recording(path, time_unit="qs^12/s^11")  # 1e-360
    for scale, span in ((1e100, r"2.25e\+100"), (1.5e308, "inf")):
        with pytest.raises(HertzchainError, match=f"forces: span {span}, must be from 1e-60 to 1e"):
            read_recording(path, scale=scale)
    with pytest.raises(HertzchainError, match=r"--scale = 0\.0: must be"):
        read_recording(path, scale=0.0)
    path = written(tmp_path / "a.csv", "{t},{f}", "Time,CH1\ns,Volt\n")
    with pytest.raises(HertzchainError, match=r"column 2 \(CH1\) is in volt: say with --scale"):
        read_recording(path)
    assert_read(read_recording(path, scale=25.0), 1.0, 25.0)


def test_columns_by_name_and_number(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "7,{f},8,{t}", "No,Load [kN],CH2,Time (ms)\n")
    for force in ("2", "Load [kN]", "Load", "load"):
        assert_read(read_recording(path, time="Time", force=force), 1e-3, 1e3)
    with pytest.raises(HertzchainError) as wrong:
        read_recording(path, time="Tme (ms)")
    assert str(wrong.value) == (
        "--time Tme (ms): no such column, there are 1 (No), 2 (Load [kN]), 3 (CH2), 4 (Time (ms))"
        "; did you mean Time (ms)?"
    )
    for number in ("0", "5"):
        with pytest.raises(HertzchainError, match="no such column"):
            read_recording(path, force=number)
    with pytest.raises(HertzchainError, match="must be two columns"):
        read_recording(path, time="4", force="4")


OSCILLOSCOPES: dict[str, tuple[str, str]] = {
    # as the manuals of their makers have it; {t}, {f}: of a sample, {k}: its number, from 0
    "Tektronix MSO": (
        ("Model,MSO4054B\nFirmware Version,3.16\n,\nHorizontal Units,S,\nSample Interval,5e-7,\n"
        "Gating,0.0% to 100.0%,\nProbe Attenuation,1,1\nVertical Units,V,V\nVertical Offset,0,0\n"
        "Vertical Position,0,0\n,,\nLabel,,\nTIME,CH1,CH2\n"), "{t},{f},0.1"),
    "Tektronix TDS": ("", "{setting},{t},{f},"),
    "Keysight": ("x-axis,7,8\nsecond,Volt,Volt\n", "{t},{f},0.1"),
    "Rigol": ("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.0,5.0e-01\n", "{k},{f},0.1,"),
    "PicoScope": ("Time,Channel A,Channel B\n(s),(V),(mV)\n\n", "{t},{f},0.1"),
    "LeCroy": (("LECROYHDO4034,1,Waveform\nSegments,1,SegmentSize,10\n"
        "Segment,TrigTime,TimeSinceSegment1\n#1,28-Nov-2026 10:00:00,0\nTime (s),Ampl (V)\n"),
        "{t},{f}"),
    "Siglent": (("Record Length,Analog:7M\nSample Interval,CH1:5e-1\nVertical Units,CH1:V\n"
        "Horizontal Units,s\nModel Number,SDS1104X\nSource,CH1\nSecond,Value\n"), "{t},{f}"),
    "Rohde & Schwarz": ("in s,C1 in V,C2 in V\n", "{t},{f},0.1"),
    "Yokogawa": (("Header Size,12\nModel Name,DLM3024\nTraceName,CH1,CH2\nBlockSize,10,10\n"
        "VUnit,V,V\nSampleRate,2.0,2.0\nHResolution,5.0e-01,5.0e-01\nHOffset,0.0,0.0\n"
        "HUnit,s,s\nDate,2026/11/28,2026/11/28\nTime,10:00:00,10:00:00\n\n"), ",{f},0.1"),
}  # fmt: skip
"""Header and form of a line of the files that oscilloscopes write."""


@pytest.mark.parametrize("maker", OSCILLOSCOPES)
def test_files_of_oscilloscopes_have_times_and_units(maker: str, tmp_path: Path) -> None:
    """Volts need a scale; times that no column has follow from the header."""
    header, form = OSCILLOSCOPES[maker]
    beside = iter(["Record Length,1.0e+01,Points", "Vertical Units,V,", "Horizontal Units,s,"])
    rows = [
        form.format(t=t, f=f, k=k, setting=next(beside, ",,") if maker == "Tektronix TDS" else "")
        for k, (t, f) in enumerate(zip(TIME, FORCE, strict=True))
    ]
    path = tmp_path / "a.csv"
    path.write_text(header + "\n".join(rows), encoding="utf-8")
    assert_read(read_recording(path, scale=25.0), 1.0, 25.0)
    with pytest.raises(HertzchainError, match=r"is in (V|volt): say with --scale"):
        read_recording(path)


@pytest.mark.parametrize(
    ("header", "form"),
    [
        ("Start,0\nIncrement,1e-6\nTIME,CH1\n", "{t},{f}"),
        ("Start,2026-11-28\nIncrement,1 us\ntime_s,force_N\n", "{t},{f}"),
        ("X;CH1;Start;Increment\nSequence;N;0,0;5,0e-01\n", "{k};{f}"),
        ("X,CH1,Start,Increment\nSequence,N,0.0,5.0e-01\n", "{k},{f},,"),
        ("Start,Increment\n0.0,5.0e-01\nTime,CH1\ns,N\n", "{k}.0,{f}"),
        ("Start,Increment\n0.0,5.0e-01\nX,CH1\nSequence,N\n", "{k:05d},{f}"),
    ],
    ids=["times of its own", "words", "decimal commas", "counts", "1.0", "00001"],
)
def test_times_are_those_of_a_column_unless_it_counts(
    header: str, form: str, tmp_path: Path
) -> None:
    path, (start, *_) = tmp_path / "a.csv", TIME
    rows = [form.format(t=t, f=f, k=k) for k, (t, f) in enumerate(zip(TIME, FORCE, strict=True))]
    body = "\n".join(rows)
    path.write_text(header + (body.replace(".", ",") if ";" in form else body), encoding="utf-8")
    assert start == 0
    assert_read(read_recording(path))
    path.write_text("X,CH1\nSequence,N\n" + "\n".join(f"{k},{k}" for k in range(20)), "utf-8")
    with pytest.raises(HertzchainError, match="column 1 counts samples, and the header has no st"):
        read_recording(path)


def test_empty_cells_are_gaps_and_other_texts_are_refused(tmp_path: Path) -> None:
    rows = [f"{t},{f},{k}" for k, (t, f) in enumerate(zip(TIME, FORCE, strict=True))]
    rows[4:4] = ["1.75,,9", "1.8,,"]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time_s,force_N,other", *rows, "99,,"]), encoding="utf-8")
    recording = read_recording(path)
    assert_read(recording)
    assert "3 with an empty cell left out" in dict(recording.facts)["file"]
    path.write_text(path.read_text("utf-8").replace("1.8,,", "1.8,off,"), encoding="utf-8")
    with pytest.raises(HertzchainError, match="line 7: has no finite time and force"):
        read_recording(path)


def test_the_first_wrong_line_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "{t};{f}", "Time;Force\n")
    lines = path.read_text(encoding="utf-8").split("\n")
    lines[2], lines[4], lines[6], lines[8] = "0.5;abc", "1.5", "0.1;1.25", "3.5;nan"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(HertzchainError) as wrong:
        read_recording(path)
    assert str(wrong.value) == (
        f"{path}: line 3 (and 2 more): has no finite time and force: correct it or delete it"
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no line has numbers in two columns"),
        (b"Time,Force\na,b\n", "no line has numbers in two columns"),
        (b"1,2\n2,3\n", "2 lines have numbers in the columns 1 and 2, must be at least 8"),
        (b"PK\x03\x04abc", "is not a text file .a spreadsheet, an archive."),
        (b"\x00\x01\x02", "is not a text file"),
        (b"1" * 300_000 + b"x\n", "no line has numbers in two columns"),  # minutes in all ways
        (b"".join(b"%d,%d\n" % (k // 2, k) for k in range(20)), "export times with more digits"),
    ],
)
def test_what_is_no_recording(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(HertzchainError, match=f"^{re.escape(str(path))}: .*{words}"):
        read_recording(path)
    for name, said in (("none.csv", "No such file"), (".", "Is a directory")):
        with pytest.raises(HertzchainError, match=said):
            read_recording(tmp_path / name)


@given(text=st.text(st.sampled_from('0123456789,.;\t \n-+eE#%abnif"'), max_size=400))
@settings(max_examples=100)
def test_any_text_is_read_or_refused(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text(text, encoding="utf-8")
    with suppress(HertzchainError):
        assert np.all(np.diff(read_recording(path).time) > 0)
