"""Documents against the files in docs/schema, by jsonschema; each key has to be described there.

The files leave more keys open, as later versions may have them. Here a key that no schema of its
object describes is an error.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

from tests.places import ROOT

FOLDER = ROOT / "docs" / "schema"

KNOWN = {
    *("$schema", "$defs", "title", "description", "$ref", "allOf", "anyOf", "type", "enum"),
    *("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"),
    *("items", "required", "properties", "additionalProperties"),
}

DESCRIBE = {"$ref", "allOf", "anyOf", "properties"}
"""Keywords that describe keys of an object."""


@cache
def read(name: str) -> dict[str, Any]:
    """A schema by the name of its file."""
    parsed: dict[str, Any] = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    return parsed


def closed(schema: dict[str, Any], whole: bool = True) -> dict[str, Any]:
    """A schema without further keys, here (``whole``) and in all that it describes."""
    if unknown := schema.keys() - KNOWN:
        raise ValueError(f"{sorted(unknown)} is not known here")
    merged = dict(schema)
    for key in ("$defs", "properties"):
        if key in schema:
            parts = schema[key].items()
            merged[key] = {name: closed(part, key == "properties") for name, part in parts}
    for key in ("allOf", "anyOf"):
        if key in schema:
            merged[key] = [closed(part, key == "anyOf") for part in schema[key]]
    for key in ("items", "additionalProperties"):
        if isinstance(schema.get(key), dict):
            merged[key] = closed(schema[key])
    if whole and schema.keys() & DESCRIBE:
        merged["unevaluatedProperties"] = False
    return merged


@cache
def all_files() -> Registry[Any]:
    """The schemas of all files by their names."""
    files = [path.name for path in FOLDER.glob("*.json")]
    resources = [(name, Resource.from_contents(closed(read(name), False))) for name in files]
    return Registry().with_resources(resources)


def problems(document: Any, file: str, pointer: str = "") -> list[str]:
    """What is wrong with a document by a schema, a sentence each."""
    schema = {"$ref": f"{file}#{pointer}", "unevaluatedProperties": False}
    errors = Draft202012Validator(schema, registry=all_files()).iter_errors(document)
    return [f"{error.json_path}: {error.message}" for error in errors]
