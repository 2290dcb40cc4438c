"""The JSON schema of scenes, from the keys of their parts.

``python -m tests.oracles.scene_schema`` writes it into docs/schema/parts.json.
"""

from __future__ import annotations

import json
from typing import Any

from hertzchain.scene.file import KEYS, OF_PROFILE
from hertzchain.scene.keys import Key
from tests.places import ROOT

FILE = ROOT / "docs" / "schema" / "parts.json"

_KINDS = {"float": "number", "int": "integer", "str": "string", "bool": "boolean"}


def schema_of(name: str, key: Key, said: str) -> dict[str, Any]:
    """The schema of a key; ``said`` describes a key that has no label."""
    if name == "shock.profile":
        return {"enum": [*OF_PROFILE]}
    if key.kind == "str":
        return {"enum": [*key.choices]}
    kind = _KINDS[key.kind]
    rule: dict[str, Any] = {"type": kind}
    if name.startswith("chain.") and key.kind != "int":  # one for each granule
        rule = {"type": [kind, "array"], "items": {"type": kind}}
    rule["description"] = key.axis if key.label else said
    words = {"above": "exclusiveMinimum", "at least": "minimum", "below": "exclusiveMaximum",
             "at most": "maximum"}  # fmt: skip
    return rule | {words[bound_name]: bound for bound_name, bound in key.bounds.items()}


def updated(parts: dict[str, Any]) -> dict[str, Any]:
    """The document with the schema of each key as the key declares it."""
    sections = parts["$defs"]["scene"]["properties"]
    for name, key in KEYS.items():
        section, _, key_name = name.partition(".")
        properties = sections[section].get("items", sections[section])["properties"]
        before = properties.get(key_name, {})
        properties[key_name] = schema_of(name, key, before.get("description", key_name))
    return parts


if __name__ == "__main__":
    schema = updated(json.loads(FILE.read_text(encoding="utf-8")))
    FILE.write_text(json.dumps(schema, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
