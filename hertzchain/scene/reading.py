"""Scene files: the parts of a scene from TOML, and back."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from hertzchain.errors import SceneError, did_you_mean, require
from hertzchain.files import read_bytes
from hertzchain.scene.chain import Chain
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.keys import Key, keys_of
from hertzchain.scene.moving import Moving
from hertzchain.scene.parts import OF_PROFILE, OTHERS, SECTIONS, key_named
from hertzchain.scene.sections import sections_of
from hertzchain.scene.segments import expand, granule_table, read_granule_table
from hertzchain.scene.shock import Shock
from hertzchain.scene.striker import Striker
from hertzchain.scene.tables import columns_of, read_table, text_of
from hertzchain.scene.uncertain import SECTIONS_OF_UNCERTAIN, read_uncertain

_Kind = TypeVar("_Kind")

_MOST_BYTES = 100_000
"""Largest size of a scene file [bytes], chosen; the one of `make demo` has 500."""
_MOST_DOTS = 200
"""Most dots in a line (chosen): tomllib's time grows as the square of the dots of a key, to 35 s at
32,000.
"""


def read_parts(path: Path) -> dict[str, Any]:
    """Read the parts of a scene file, by the names of the arguments of ``Scene``.

    A SceneError names file, key, value and what is allowed.
    """
    document = _load(path)
    try:
        return _parts(document, path.parent)
    except SceneError as problem:
        raise SceneError(
            problem.key, problem.value, problem.allowed, problem.file or path
        ) from None


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
        content = read_bytes(path, _MOST_BYTES)
    except IsADirectoryError:
        raise SceneError("", None, "is a directory, must be a TOML file", path) from None
    except (OSError, ValueError) as problem:  # ValueError: a null character in the name
        reason = getattr(problem, "strerror", None) or problem
        raise SceneError(
            "", None, f"cannot be read ({reason}), must be a TOML file", path
        ) from None
    try:
        text = content.decode("utf-8-sig")
        if any(line.count(".") > _MOST_DOTS for line in text.split("\n")):
            raise ValueError(f"a line with more than {_MOST_DOTS} dots")  # noqa: TRY301
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise SceneError("", None, "is not TOML: save it as UTF-8 text", path) from None
    except (ValueError, RecursionError) as problem:  # not TOML, or nested too deeply
        hint = '; a value with a unit stands in quotes, "103 GPa"'
        if any(word in str(problem) for word in _GIVEN_TWICE):
            hint = "; a key or a section is given twice: delete one of them"
        raise SceneError("", None, f"is not TOML: {problem!s:.200}{hint}", path) from None


_GIVEN_TWICE = ("overwrite a value", "Duplicate", "twice")
"""Part of tomllib's message on a key or a section that is given twice; its errors have no code."""


def _parts(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    for key, value in document.items():
        allowed = f"unknown key, allowed are the sections {', '.join(SECTIONS)}"
        require(key in SECTIONS, key, value, allowed + did_you_mean(key, SECTIONS))
        if key == "gauge":
            allowed = "must be [[gauge]], with two brackets: there may be several"
            is_list = isinstance(value, list) and all(isinstance(one, dict) for one in value)
            require(is_list, key, value, allowed)
            continue
        require(isinstance(value, dict), key, value, f"must be a section, [{key}]")
    require("chain" in document, "[chain]", None, "missing section")
    if "shock" in document and "striker" in document:
        allowed = "both sections are given, at most one is allowed"
        raise SceneError("[shock] and [striker]", None, allowed)
    parts: dict[str, Any] = {
        "chain": read_chain(document["chain"], folder),
        "shock": _shock_of(document, folder),
    }
    others = {name: kind for name, kind in OTHERS.items() if name in document}
    parts |= {name: _section(name, document[name], kind) for name, kind in others.items()}
    if "gauge" in document:
        parts["gauges"] = tuple(_section("gauge", one, Gauge) for one in document["gauge"])
    of_both = ((name, document.get(name, {})) for name in SECTIONS_OF_UNCERTAIN)
    parts["uncertain"] = tuple(one for part in of_both for one in read_uncertain(*part, key_named))
    return parts


def read_chain(section: Mapping[str, Any], folder: Path = Path()) -> Chain:
    """Read a chain from its section; a SceneError names the key. ``folder`` has its tables."""
    if "file" in section:
        allowed = "not allowed with chain.file, which has every granule"
        for key, value in section.items():
            require(key in ("file", "granules"), f"chain.{key}", value, allowed)
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
    return expand(defaults, section["segments"], quantities)


def _shock_of(document: Mapping[str, Any], folder: Path) -> Shock:
    """Return the striker or the shock of a document, which has at most one of them."""
    if "striker" in document:
        return _section("striker", document["striker"], Striker)
    return _shock(document["shock"], folder) if "shock" in document else Moving()


def _shock(section: Mapping[str, Any], folder: Path) -> Shock:
    """Read a shock; its ``profile`` comes first, because the other keys depend on it."""
    profile = section.get("profile")
    missing = "" if "profile" in section else "missing, "
    known = isinstance(profile, str) and profile in OF_PROFILE
    allowed = f"{missing}must be one of {', '.join(OF_PROFILE)}"
    require(known, "shock.profile", profile, allowed)
    kind = OF_PROFILE[str(profile)]
    keys = keys_of(kind)
    if kind.column is None:
        besides = () if "profile" in keys else ("profile",)
        return _section("shock", section, kind, besides)
    if "file" not in section and "velocity" in keys:  # a piston without a table
        return _section("shock", section, kind, ("profile", "file"))
    of_table = {key: one for key, one in keys.items() if key == "granule"}
    takes = ("profile", "file", *of_table)
    for key in (key for key in section if key_named(f"shock.{key}")):
        allowed = f"not allowed where a file is the shock, which takes {', '.join(takes)}"
        require(key in takes, f"shock.{key}", section[key], allowed)
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
    name: str, section: Mapping[str, Any], known: Mapping[str, Key], besides: Iterable[str] = ()
) -> dict[str, Any]:
    """Return the values of a section in SI; errors name the key with its section.

    ``besides`` has further allowed keys, which are read elsewhere.
    """
    names = [*known, *besides]
    values: dict[str, Any] = {}
    for key, value in section.items():
        full = f"{name}.{key}"
        allowed = f"unknown key, allowed are {', '.join(names)}{did_you_mean(key, names)}"
        if key == "diameter" and "radius" in known:
            allowed = "unknown key: write radius, half of it"
        require(key in names, full, value, allowed)
        values[key] = known[key].read(full, value) if key in known else value
    return values


def _section(
    name: str, section: Mapping[str, Any], kind: Callable[..., _Kind], besides: Iterable[str] = ()
) -> _Kind:
    """Build one frozen object from its section; errors name the key with its section."""
    known = keys_of(kind)  # type: ignore[arg-type]
    values = quantities(name, section, known, besides)
    for item in fields(kind):  # type: ignore[arg-type]
        if item.name in known and item.name not in values:
            missing = ", ".join(filter(None, ("missing", known[item.name].is_one_of)))
            require(item.default is not MISSING, f"{name}.{item.name}", None, missing)
    try:
        return kind(**{key: value for key, value in values.items() if key in known})
    except SceneError as problem:
        given = section.get(problem.key, problem.value)
        raise SceneError(f"{name}.{problem.key}", given, problem.allowed) from None
