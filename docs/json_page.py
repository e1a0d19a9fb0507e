#!/usr/bin/env python3
"""Writes the tables of docs/json.md anew from docs/glasswarp.schema.json."""

import json
import pathlib

FOLDER = pathlib.Path(__file__).parent
FIRST = ["Document", "Result", "Fault", "FaultKind"]


def kind(schema):
    """What a value holds, in a few words."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(kind(one) for one in schema["anyOf"])
    names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    words = {"string": "text", "integer": "whole number", "number": "number", "boolean": "true or false", "null": "null"}
    return " or ".join(f"list of {kind(schema['items'])}" if name == "array" else words[name] for name in names)


def section(name, schema):
    text = f"## {name}\n\n{schema['description']}\n\n"
    if name == "Result":
        return text + f"By the command, one of: {', '.join(kind(one) for one in schema['anyOf'])}.\n"
    if "oneOf" in schema:
        return text + "".join(f"- `{one['const']}`: {one['description']}\n" for one in schema["oneOf"])
    rows = (f"| `{key}` | {kind(of)} | {of['description']} |\n" for key, of in sorted(schema["properties"].items()))
    return text + "| key | holds | meaning |\n|---|---|---|\n" + "".join(rows)


schema = json.loads((FOLDER / "glasswarp.schema.json").read_text())
records = {"Document": schema, **schema["$defs"]}
order = FIRST + sorted(name for name in records if name not in FIRST)
page = FOLDER / "json.md"
head = page.read_text().split("## Document", 1)[0]
page.write_text(head + "\n".join(section(name, records[name]) for name in order))
