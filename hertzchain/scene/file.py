"""Scene files: the parts of a scene from TOML, and back."""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, asdict, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from hertzchain.errors import SceneError, did_you_mean, require
from hertzchain.files import read_bytes, read_rows
from hertzchain.scene.chain import MATERIAL, MOST_UNLIKE_GRANULES, Chain
from hertzchain.scene.keys import Key, Section, keys_of, to_si
from hertzchain.scene.schedule import Run
from hertzchain.scene.shocks import (
    HalfSine,
    Moving,
    Piston,
    Pulse,
    PulseTable,
    Sawtooth,
    Shock,
    Sine,
    Striker,
    Trapezoid,
)
from hertzchain.scene.terms import (
    OF_GRANULES,
    SPREAD_ALLOWED,
    Contact,
    Gauge,
    Precompression,
    Uncertain,
    Wall,
)

_CELL_KEYS = {name: key for name, key in keys_of(Chain).items() if name != "granules"}
"""Keys by which a granule of a segment can differ."""

RADIUS_RATIO = Key("", "radius over that of the granule before", above=0)
"""Key of a taper: a segment without a cell."""

SEGMENT_KEYS = {"granules": Key("", "granules", least=1, most=MOST_UNLIKE_GRANULES, kind="int"),
               **_CELL_KEYS, "radius_ratio": RADIUS_RATIO}  # fmt: skip
"""Keys of a segment."""

_COLUMNS = {
    "_".join((name, *key.unit.replace("/", "_").replace("^", "").split())): name
    for name, key in _CELL_KEYS.items()
}
"""Columns of a table of granules, with their keys."""

_OPTIONAL_COLUMNS = tuple(name for name in _COLUMNS if _COLUMNS[name] not in ("radius", "gap"))
"""Columns that may be absent; those of the material only where others take their place."""

_Shock = TypeVar("_Shock", bound=Shock)

_LARGEST_FILE_BYTES = 50_000_000
"""Largest size of a file [bytes], chosen: half a million granules, two million rows of a pulse."""


def columns_of(shock: Shock) -> dict[str, Sequence[float]]:
    """Return the columns of a shock's table by name; empty if it has no table."""
    if shock.column is None or not shock.rows:
        return {}
    time, values = zip(*shock.rows, strict=True)
    return {"time_s": time, shock.column[1]: values}


def text_of(columns: Mapping[str, Sequence[float]]) -> str:
    """Return the text of a CSV file with these columns; truth values are written as 0 or 1."""
    rows = (",".join(repr(+value) for value in row) for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"


def read_columns(
    path: Path,
    key: str,
    name: str | None,
    names: Collection[str],
    optional: Collection[str] = (),
) -> dict[str, tuple[float, ...]]:
    """Return the columns of a CSV file of numbers by their names.

    A SceneError says what is wrong; ``key`` and ``name`` are those of the file in a scene file.
    """
    try:
        header, rows = read_rows(path, _LARGEST_FILE_BYTES)
    except ValueError as problem:
        allowed = f"cannot be read ({problem}); must be a CSV file"
        raise SceneError(key, name, allowed, None if name else path) from None
    required = [column for column in names if column not in optional]
    allowed = f"must be {','.join(required)}"
    allowed += f", and perhaps {', '.join(optional)}" if optional else ""
    for column in (column for column in header if column not in names):
        raise SceneError("column", column, f"is unknown: the first line {allowed}", path)
    if sorted(header) != sorted({*header, *required}):
        raise SceneError("first line", ",".join(header), allowed, path)
    values = []
    for number, row in enumerate(rows, start=1):
        try:
            values.append([float(cell) for cell in row])
        except ValueError:
            values.append([])
        if len(values[-1]) != len(header):
            allowed = f"must be {len(header)} numbers, {','.join(header)}"
            raise SceneError(f"row {number}", ",".join(row), allowed, path)
    return {column: tuple(row[k] for row in values) for k, column in enumerate(header)}


def read_table(kind: type[_Shock], path: Path, name: str | None = None) -> _Shock:
    """Read a shock from a CSV file with the header ``time_s`` and the column of its values."""
    assert kind.column is not None
    field, column = kind.column
    columns = read_columns(path, "shock.file", name, ("time_s", column))
    values: dict[str, Any] = {"time": columns["time_s"], field: columns[column]}
    with _errors_of(file=path):
        return kind(**values, file=name or str(path))  # type: ignore[call-arg]


@contextmanager
def _errors_of(
    prefix: str = "", file: Path | None = None, section: Section | None = None
) -> Iterator[None]:
    """Name the file in a SceneError, or the section: with the value as it is given there."""
    try:
        yield
    except SceneError as problem:
        key, value = f"{prefix}{problem.key}", (section or {}).get(problem.key, problem.value)
        raise SceneError(key, value, problem.allowed, file) from None


def expand(defaults: Chain, segments: Any) -> Chain:
    """Return a chain, granule by granule, from its defaults and what each segment changes."""
    allowed = "must be one or more tables, [[chain.segments]]"
    require(isinstance(segments, list) and bool(segments), "chain.segments", segments, allowed)
    most, total, usual = defaults.granules, 0, asdict(defaults)
    columns: dict[str, list[Any]] = {key: [] for key in _CELL_KEYS}
    read: list[dict[str, Any]] = []
    sums = f"the granules of all segments must sum to chain.granules = {most}, they are"
    for number, segment in enumerate(segments, start=1):
        name = f"chain.segments.{number}"
        require(isinstance(segment, dict), name, segment, allowed)
        values = quantities(name, segment, SEGMENT_KEYS, ("cell",))
        require("granules" in values, f"{name}.granules", None, "missing")
        few = f"must be at most {MOST_UNLIKE_GRANULES}"
        require(most <= MOST_UNLIKE_GRANULES, "chain.granules", most, few)
        granules, ratio = values["granules"], values.get("radius_ratio", 1.0)
        SEGMENT_KEYS["granules"].check(f"{name}.granules", granules)
        total += granules
        require(total <= most, f"{name}.granules", granules, f"{sums} more")
        cells = _cells(name, values)
        RADIUS_RATIO.check(f"{name}.radius_ratio", ratio)
        for key, value in itertools.chain(*(part.items() for part in (values, *cells))):
            only = f"is allowed only with chain.{key}, for the granules that have none here"
            is_missing = key in _CELL_KEYS and usual[key] is None
            require(not is_missing, f"{name}.{key}", value, only)
        read.append({**values, "cell": cells} if "cell" in values else values)
        for k in range(granules):
            granule = {**usual, **values, **cells[k % len(cells)]}
            granule["radius"] = _tapered(granule["radius"], ratio, k)
            for key, column in columns.items():
                column.append(granule[key])
    require(total == most, "chain.segments", None, f"{sums} fewer")
    with _errors_of("chain."):
        chain = Chain(most, *(None if usual[key] is None else columns[key] for key in columns))
    kept = {key: value for key, value in usual.items() if value is not None}
    chain.__dict__["_section"] = {**kept, "segments": read}
    return chain


def _cells(name: str, values: Section) -> list[dict[str, Any]]:
    """Return the differing values of each granule of the cell that a segment repeats."""
    cell = values.get("cell", [{}])
    allowed = "must be a list of one or more tables, [{...}, {...}]; {} is a granule as in [chain]"
    is_cell = isinstance(cell, list) and cell and all(isinstance(granule, dict) for granule in cell)
    require(bool(is_cell), f"{name}.cell", cell, allowed)
    allowed, ratio = (
        "not allowed with a cell, in which each granule has its own radius",
        "radius_ratio",
    )
    require(not {"cell", ratio} <= values.keys(), f"{name}.{ratio}", values.get(ratio), allowed)
    return [
        quantities(f"{name}.cell.{k}", granule, _CELL_KEYS) for k, granule in enumerate(cell, 1)
    ]


def _tapered(radius: float, ratio: float, k: int) -> float:
    """Radius of the k-th granule of a taper [m]; infinite beyond the range of floating point."""
    try:
        return float(radius * ratio**k)
    except OverflowError:
        return math.inf


def read_granule_table(path: Path, name: str | None = None) -> Chain:
    """Read a chain from a CSV file with a row for each granule. A SceneError says what is wrong."""
    table = read_columns(path, "chain.file", name, _COLUMNS, _OPTIONAL_COLUMNS)
    values: dict[str, Any] = {_COLUMNS[heading]: column for heading, column in table.items()}
    with _errors_of(file=path):
        for row, value in enumerate(values.get("fixed", ()), start=1):
            require(value in (0, 1), f"fixed in row {row}", value, "must be 0 or 1")
        if "fixed" in values:
            values["fixed"] = [bool(value) for value in values["fixed"]]
        return Chain(len(values["radius"]), **values)


def granule_table(chain: Chain) -> str:
    """Return the text that ``read_granule_table`` reads back as the same chain."""
    columns = {column: getattr(chain, key) for column, key in _COLUMNS.items()}
    return text_of(
        {
            column: value if isinstance(value, tuple) else (value,) * chain.granules
            for column, value in columns.items()
            if value or _COLUMNS[column] in (*MATERIAL, "gap")
            if value is not None
        }
    )


SHOCKS: tuple[type[Shock], ...] = (
    Pulse, HalfSine, Sawtooth, Trapezoid, PulseTable, Striker, Piston, Sine, Moving,
)  # fmt: skip
"""All shocks: one entry each."""

OF_PROFILE = {
    name: shock for shock in SHOCKS if shock.section == "shock" for name in shock.profiles
}
"""Shocks by their names in ``profile`` of a section [shock]."""

OTHERS: dict[str, type] = {
    "wall": Wall,
    "near_wall": Wall,
    "precompression": Precompression,
    "contact": Contact,
    "run": Run,
}
"""Parts that a scene may have next to its chain and its shock, by section."""

_PARTS = [
    ("chain", Chain),
    *((shock.section, shock) for shock in SHOCKS if shock.section),
    *OTHERS.items(),
    ("gauge", Gauge),
]

SECTIONS = tuple(sorted({"uncertainty", "scatter", *(section for section, _ in _PARTS)}))

KEYS: dict[str, Key] = {
    f"{section}.{name}": key for section, part in _PARTS for name, key in keys_of(part).items()
}
"""All keys by section and name, as ``chain.radius``."""

SEGMENT = re.compile(r"(?:chain\.)?segments\.(\d+)\.(?:cell\.(\d+)\.)?(\w+)")
"""The name of a key of a segment: its number, that of a granule of its cell, the key."""


def full_names(name: object, names: Iterable[str], preferred: Collection[str] = ()) -> list[str]:
    """Return the full name of a key that is given with or without its section; empty if unknown.

    If several sections have the key, a preferred one is taken, else a SceneError lists them.
    """
    matches = [full for full in names if name in (full, full.partition(".")[2] or full)]
    if len(matches) > 1:
        matches = [full for full in matches if full in preferred] or matches
    allowed = f"is in several sections: name one of {', '.join(matches)}"
    require(len(matches) <= 1, str(name), None, allowed)
    return matches


def key_named(name: str) -> Key | None:
    """Return the key of a name, with or without its section, also of a segment; None if unknown.

    The same name has the same unit in every section.
    """
    if (segment := SEGMENT.fullmatch(name)) is not None:
        return SEGMENT_KEYS.get(segment[3])
    keys = (key for full, key in KEYS.items() if name in (full, full.partition(".")[2]))
    return next(keys, None)


def sections_of(scene: Any, defaults: bool = True) -> dict[str, Any]:
    """A scene as in its file, in SI: a JSON object for each section, with a value for each key.

    Values that are not given are left out. Tables stand in the sections by their columns: those of
    a pulse or a piston as ``time_s`` and ``force_N`` or ``displacement_m``, those of unlike
    granules as lists with one number for each, or as the segments of the scene file. Without
    ``defaults`` these are left out, and segments, too.
    """
    chain, shock = scene.chain, scene.shock
    sections: dict[str, Any] = {
        "chain": _given(chain, defaults)
        if chain.section is None or not defaults
        else {**chain.section},
        shock.section: _of_shock(shock, defaults),
        **{name: _given(getattr(scene, name), defaults) for name in OTHERS},
        "gauge": [_given(gauge, defaults) for gauge in scene.gauges],
        "uncertainty": {entry.key: entry.written for entry in scene.uncertain if not entry.each},
        "scatter": {entry.key: entry.written for entry in scene.uncertain if entry.each},
    }
    absent = {
        **{f"{section}.gap": 0 for section in ("chain", "wall", "near_wall")},
        "chain.velocity": 0,
        "chain.fixed": False,
        f"{shock.section}.granule": 1,
    }
    for name, value in absent.items():
        section, _, key = name.partition(".")
        if sections[section].get(key) == value:
            del sections[section][key]
    return {name: section for name, section in sections.items() if section}


def _of_shock(shock: Shock, defaults: bool) -> dict[str, Any]:
    """Return the section of a shock; it contains a table as columns."""
    values = {} if shock.section != "shock" else {"profile": shock.profile_name}
    columns = {name: list(column) for name, column in columns_of(shock).items()}
    if not columns:
        return values | _given(shock, defaults)
    more = {} if shock.granule == 1 else {"granule": shock.granule}
    return {**values, **more, **columns}


def _given(part: Any, defaults: bool) -> dict[str, Any]:
    """The fields of a frozen object that are given, without None and perhaps without defaults."""
    if part is None:
        return {}
    values = {field.name: (getattr(part, field.name), field.default) for field in fields(part)}
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, (value, default) in values.items()
        if value is not None and key != "file" and (defaults or value != default)
    }


_Kind = TypeVar("_Kind")


def read_parts(path: Path) -> dict[str, Any]:
    """Read the parts of a scene file, by the names of the arguments of ``Scene``.

    A SceneError names key, value and what is allowed.
    """
    return _parts(_load(path), path.parent)


def texts_of(path: Path, scene: Any) -> dict[Path, str]:
    """Return the texts of a scene by path: first its tables, if any, then the TOML."""
    import tomli_w

    texts: dict[Path, str] = {}
    document, shock = sections_of(scene, defaults=False), scene.shock
    if any(isinstance(value, list) for value in document["chain"].values()):
        table = path.with_suffix(".granules.csv")
        texts[table] = granule_table(scene.chain)
        document["chain"] = {"file": table.name}
    if columns := columns_of(shock):
        table = path.with_suffix(".csv")
        allowed = "must not end in .csv: the table of the shock is written under that name"
        require(table != path, "path", str(path), allowed)
        texts[table] = text_of(columns)
        kept = {key: document["shock"][key] for key in ("granule",) if key in document["shock"]}
        document["shock"] = {"profile": shock.profile_name, "file": table.name, **kept}
    return {**texts, path: tomli_w.dumps(document)}


def _load(path: Path) -> dict[str, Any]:
    try:
        content = read_bytes(path, _LARGEST_FILE_BYTES)
    except (OSError, ValueError) as problem:  # ValueError: a null character in the name
        reason = getattr(problem, "strerror", None) or problem
        allowed = f"cannot be read ({reason}), must be a TOML file"
        raise SceneError("", None, allowed, path) from None
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise SceneError("", None, "is not TOML: save it as UTF-8 text", path) from None
    except (ValueError, RecursionError) as problem:  # not TOML, or nested too deeply
        hint = 'a key or a section stands once, a value with a unit in quotes, "103 GPa"'
        raise SceneError("", None, f"is not TOML: {problem!s:.200}; {hint}", path) from None


def _parts(document: Section, folder: Path) -> dict[str, Any]:
    for key, value in document.items():
        allowed = f"unknown key, allowed are the sections {', '.join(SECTIONS)}"
        require(key in SECTIONS, key, value, allowed + did_you_mean(key, SECTIONS))
        if key == "gauge":
            allowed = "must be [[gauge]], with two brackets: there may be several"
            is_list = isinstance(value, list) and all(isinstance(gauge, dict) for gauge in value)
            require(is_list, key, value, allowed)
            continue
        require(isinstance(value, dict), key, value, f"must be a section, [{key}]")
    require("chain" in document, "[chain]", None, "missing section")
    if "shock" in document and "striker" in document:
        allowed = "both sections are given, at most one is allowed"
        raise SceneError("[shock] and [striker]", None, allowed)
    parts: dict[str, Any] = {
        "chain": read_chain(document["chain"], folder),
        "shock": _shock(document, folder),
    }
    others = {name: kind for name, kind in OTHERS.items() if name in document}
    parts |= {name: _section(name, document[name], kind) for name, kind in others.items()}
    if "gauge" in document:
        parts["gauges"] = tuple(_section("gauge", gauge, Gauge) for gauge in document["gauge"])
    parts["uncertain"] = tuple(_read_uncertain(document))
    return parts


_PERCENT = re.compile(r"\s*([-+.\deE]+)\s*%\s*")


def _read_uncertain(document: Section) -> Iterator[Uncertain]:
    """Read [uncertainty] and [scatter]; a SceneError names the key with its section."""
    possible = [name for name in KEYS if name.partition(".")[0] in document]
    present = {f"{section}.{key}" for section in document for key in document[section]}
    entries = (
        (section, *entry)
        for section in ("uncertainty", "scatter")
        for entry in _flat(document.get(section, {}))
    )
    for section, given, value in entries:
        name, is_scatter = f"{section}.{given}", section == "scatter"
        full = f"chain.{given}" if is_scatter and f"chain.{given}" in OF_GRANULES else given
        is_uniform = isinstance(value, dict)
        require(not is_uniform or list(value) == ["half_width"], name, value, SPREAD_ALLOWED)
        written = value["half_width"] if is_uniform else value
        percent = _PERCENT.fullmatch(written) if isinstance(written, str) else None
        try:
            if not is_scatter:
                full = next(iter(full_names(given, possible, present)), given)
            key = key_named(full)
            can_vary = key is not None and key.kind == "float" and bool(key.label) and "." in full
            allowed = "has no quantity; write the key as in the scene, such as chain.young_modulus"
            require(can_vary, name, value, allowed)
            unit = key.unit if key is not None else ""
            size = float(percent[1]) / 100 if percent else to_si(name, written, unit)
            yield Uncertain(full, size, percent is not None, is_uniform, is_scatter)
        except SceneError as problem:
            raise SceneError(name, value, problem.allowed) from None
        except ValueError:
            raise SceneError(name, value, SPREAD_ALLOWED) from None


def _flat(values: Section, before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys with their values; without quotes TOML makes tables of ``chain.radius``."""
    for name, value in values.items():
        if isinstance(value, dict) and value and "half_width" not in value:
            yield from _flat(value, f"{before}{name}.")
        else:
            yield before + name, value


def read_chain(section: Section, folder: Path = Path()) -> Chain:
    """Read a chain from its section; a SceneError names the key. ``folder`` has its tables."""
    if "file" in section:
        quantities("chain", section, {}, ("file", "granules"))
        name = section["file"]
        require(isinstance(name, str), "chain.file", name, "must be the name of a CSV file")
        chain = read_granule_table(folder / name, name)
        given = section.get("granules", chain.granules)
        allowed = f"must be {chain.granules}, the rows of chain.file, or left out"
        require(given == chain.granules, "chain.granules", given, allowed)
        return chain
    if "segments" not in section:
        return _section("chain", section, Chain, ("segments", "file"))
    plain = {key: value for key, value in section.items() if key != "segments"}
    defaults = _section("chain", plain, Chain, ("segments", "file"))
    return expand(defaults, section["segments"])


def _shock(document: Section, folder: Path) -> Shock:
    """Return the striker or the shock of a document; its ``profile`` decides on its other keys."""
    if "striker" in document:
        return _section("striker", document["striker"], Striker)
    if "shock" not in document:
        return Moving()
    section = document["shock"]
    profile = section.get("profile")
    missing = "" if "profile" in section else "missing, "
    is_profile = isinstance(profile, str) and profile in OF_PROFILE
    allowed = f"{missing}must be one of {', '.join(OF_PROFILE)}"
    require(is_profile, "shock.profile", profile, allowed)
    kind = OF_PROFILE[str(profile)]
    keys = keys_of(kind)
    if kind.column is None or ("file" not in section and "velocity" in keys):
        besides = [*({"profile"} - keys.keys()), *(["file"] if kind.column else [])]
        return _section("shock", section, kind, besides)
    of_table = {"granule": keys["granule"]} if "granule" in keys else {}
    values = quantities("shock", section, of_table, ("profile", "file"))
    name = values.get("file")
    require("file" in section, "shock.file", None, f'missing, profile = "{profile}" needs it')
    require(isinstance(name, str), "shock.file", name, "must be the name of a CSV file")
    table = read_table(kind, folder / str(name), name)
    if "granule" not in values:
        return table
    keys["granule"].check("shock.granule", values["granule"])
    return replace(table, granule=values["granule"])  # type: ignore[call-arg]


def quantities(
    name: str, section: Section, keys: Mapping[str, Key], besides: Iterable[str] = ()
) -> dict[str, Any]:
    """Return the values of a section in SI; errors name the key with its section.

    ``besides`` has further allowed keys, which are read elsewhere.
    """
    names = [*keys, *besides]
    values: dict[str, Any] = {}
    for key, value in section.items():
        full = f"{name}.{key}"
        problem = "unknown key"
        if {"file"} & section.keys() & {*names}:
            problem = "not allowed with file"
        elif full in KEYS:
            problem = f'not a key of profile = "{section.get("profile")}"'
        allowed = f"{problem}, allowed are {', '.join(names)}{did_you_mean(key, names)}"
        if key == "diameter" and "radius" in keys:
            allowed = "unknown key: write radius, half of it"
        require(key in names, full, value, allowed)
        values[key] = keys[key].read(full, value) if key in keys else value
    return values


def _section(
    name: str, section: Section, kind: Callable[..., _Kind], besides: Iterable[str] = ()
) -> _Kind:
    """Build one frozen object from its section; errors name the key with its section."""
    keys = keys_of(kind)  # type: ignore[arg-type]
    values = quantities(name, section, keys, besides)
    for item in fields(kind):  # type: ignore[arg-type]
        if item.name in keys and item.name not in values:
            missing = ", ".join(filter(None, ("missing", keys[item.name].is_one_of)))
            require(item.default is not MISSING, f"{name}.{item.name}", None, missing)
    with _errors_of(f"{name}.", section=section):
        return kind(**{key: value for key, value in values.items() if key in keys})
