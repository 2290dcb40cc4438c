"""JSON Schema, as far as the files in docs/schema use it, and whether they describe every key.

Draft 2020-12. A keyword that is not known here is an error, so that nothing goes unchecked.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from tests.places import ROOT

FOLDER = ROOT / "docs" / "schema"

KNOWN = {
    *("$schema", "$defs", "title", "description", "$ref", "allOf", "anyOf", "type", "enum"),
    *(
        "minimum",
        "exclusiveMinimum",
        "maximum",
        "exclusiveMaximum",
        "items",
        "required",
        "properties",
        "additionalProperties",
    ),
}

TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "boolean": (bool,),
    "integer": (int,),
    "number": (int, float),
    "null": (type(None),),
}


@cache
def read(name: str) -> dict[str, Any]:
    """A schema by the name of its file."""
    found: dict[str, Any] = json.loads((FOLDER / name).read_text(encoding="utf-8"))
    return found


def resolved(ref: str, file: str) -> tuple[dict[str, Any], str]:
    """What a reference in a file refers to, and the file that is in."""
    name, _, pointer = ref.partition("#")
    schema = read(name or file)
    for key in filter(None, pointer.split("/")):
        schema = schema[key]
    return schema, name or file


def problems(document: Any, file: str, pointer: str = "") -> list[str]:
    """What is wrong with a document by a schema, a sentence each."""
    schema, file = resolved(f"{file}#{pointer}", file)
    return list(_check(document, schema, file, "document"))


def _check(
    value: Any, schema: dict[str, Any], file: str, at: str, whole: bool = True
) -> Iterator[str]:
    """Problems of a value; ``whole`` says that this schema alone has to describe its keys."""
    if unknown := schema.keys() - KNOWN:
        raise ValueError(f"{file}: {sorted(unknown)} in {at} is not known here")
    if "$ref" in schema:
        yield from _check(value, *resolved(schema["$ref"], file), at, whole=False)
    for part in schema.get("allOf", ()):
        yield from _check(value, part, file, at, whole=False)
    if "anyOf" in schema:
        tried = [list(_check(value, part, file, at)) for part in schema["anyOf"]]
        if all(tried):
            yield f"{at}: none of {len(tried)}: {tried}"
    if "type" in schema and not _is_of(value, schema["type"]):
        yield f"{at}: {value!r:.60} is not of {schema['type']}"
        return
    if "enum" in schema and value not in schema["enum"]:
        yield f"{at}: {value!r:.60} is not in {schema['enum']}"
    if isinstance(value, int | float):
        yield from _check_size(value, schema, at)
    if isinstance(value, list):
        for k, item in enumerate(value):
            yield from _check(item, schema.get("items", {}), file, f"{at}[{k}]")
    if isinstance(value, dict):
        yield from _check_keys(value, schema, file, at, whole)


def _check_size(value: float, schema: dict[str, Any], at: str) -> Iterator[str]:
    if value < schema.get("minimum", value):
        yield f"{at}: {value} is below {schema['minimum']}"
    if "exclusiveMinimum" in schema and value <= schema["exclusiveMinimum"]:
        yield f"{at}: {value} is not above {schema['exclusiveMinimum']}"
    if value > schema.get("maximum", value):
        yield f"{at}: {value} is above {schema['maximum']}"
    if "exclusiveMaximum" in schema and value >= schema["exclusiveMaximum"]:
        yield f"{at}: {value} is not below {schema['exclusiveMaximum']}"


def _check_keys(
    value: dict[str, Any], schema: dict[str, Any], file: str, at: str, whole: bool
) -> Iterator[str]:
    for name in schema.get("required", ()):
        if name not in value:
            yield f"{at}: {name} is missing"
    properties, others = schema.get("properties", {}), schema.get("additionalProperties")
    for name, item in value.items():
        if name in properties:
            yield from _check(item, properties[name], file, f"{at}.{name}")
        elif others is not None:
            yield from _check(item, others, file, f"{at}.{name}")
    described = _described(schema, file)
    if whole and described is not None and (more := value.keys() - described):
        yield f"{at}: {sorted(more)} are not described"


def _described(schema: dict[str, Any], file: str) -> set[str] | None:
    """The keys that a schema describes; None where it is about any."""
    parts = [(part, file) for key in ("allOf", "anyOf") for part in schema.get(key, ())]
    if "$ref" in schema:
        parts.append(resolved(schema["$ref"], file))
    found = [_described(*part) for part in parts]
    if "properties" in schema:
        is_open = "additionalProperties" in schema
        found.append(None if is_open else set(schema["properties"]))
    if not found or None in found:
        return None
    return set().union(*(keys for keys in found if keys is not None))


def _is_of(value: Any, names: str | list[str]) -> bool:
    wanted = [names] if isinstance(names, str) else names
    if isinstance(value, bool):
        return "boolean" in wanted
    return isinstance(value, tuple(kind for name in wanted for kind in TYPES[name]))
