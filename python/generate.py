#!/usr/bin/env python3
"""Writes what follows from the library: the keywords of every call (glasswarp/_keywords.py), the records that calls return
(glasswarp/_records.py, from docs/glasswarp.schema.json), and the table of options in docs/python.md. With --check it writes nothing, and
fails if anything is not as it would be written."""

from __future__ import annotations

import json
import pathlib
import sys
import textwrap
from collections.abc import Iterable
from typing import Any

FOLDER = pathlib.Path(__file__).resolve().parent
# The sources beside this script have no extension module; the package that is installed has.
sys.path = [place for place in sys.path if pathlib.Path(place).resolve() != FOLDER]

from glasswarp import _listed  # noqa: E402

DOCS = FOLDER.parent / "docs"
MADE = '"""{about} Made by generate.py."""\n\nfrom __future__ import annotations\n\n'

#: The call of every command, and the name of its keywords.
CALLS = {
    "design": "command",
    "preview": "preview",
    "verify": "verify",
    "merge": "merge",
    "check": "check",
    "mill": "mill",
    "ready": "ready",
    "coupon": "coupon",
    "crosscheck": "crosscheck",
    "materials": "materials",
    "presets": "presets",
    "completions": "command",
    "man": "command",
}
#: Options of `glasswarp verify` that are calls of their own.
OF_OTHER_CALLS = {
    "tally": "photons",
    "shard": "photons",
    "sweep": "sweep",
    "steps": "sweep",
    "as-built": "sweep",
}
#: Options of `glasswarp verify` about a machine's program go by this call.
OF_PROGRAMS = {"tool", "design", "origin", "stock", "travel", "acceleration", "rapid", "units", "polish", "pictures"}


def call(name: str, option: _listed.Option) -> str:
    """The call that takes an option of a command."""
    if name == "verify":
        if option.flag in OF_OTHER_CALLS:
            return OF_OTHER_CALLS[option.flag]
        if option.flag in OF_PROGRAMS:
            return "program"
    return "design" if name == "design" and (option.is_setting or option.flag == "ignore-memory") else CALLS[name]


def wrapped(text: str, indent: str, first: str = "") -> str:
    text = " ".join(text.split())
    return textwrap.fill(text, 118, initial_indent=indent + first, subsequent_indent=indent)


def described(option: _listed.Option) -> str:
    """The words of the command line, in which flags are keywords."""
    from glasswarp._errors import in_keywords

    words = in_keywords(" ".join(option.help.split()))
    return words + (f" [default: {option.default}]" if option.default else "")


# --- keywords


def kind(option: _listed.Option) -> str:
    """The type of an option's value, for a type checker."""
    one = {
        "flag": "bool",
        "switch": "bool",
        "whole": "int",
        "number": "float",
        "path": "Path",
        "text": f"Literal[{', '.join(map(repr, option.choices))}]" if option.choices else "Text",
    }[option.kind]
    return f"Union[{one}, Sequence[{one}]]" if option.several else one


def keywords(name: str, about: str, options: Iterable[_listed.Option]) -> str:
    lines = [f"class {name}(TypedDict, total=False):", wrapped(about, "    ", '"""') + '"""', ""]
    for option in options:
        comment = wrapped(described(option), "    #: ")
        if option.unit:
            lines += [comment, f"    {option.keyword}: Numbers", f"    {option.bare}: {kind(option)}"]
        else:
            lines += [comment, f"    {option.keyword}: {kind(option)}"]
    return "\n".join(lines) + "\n"


def keywords_file() -> str:
    commands = _listed.commands()
    parts = [
        MADE.format(about="The keywords of every call, for type checkers and readers."),
        "import os\nfrom typing import Literal, Sequence, TypedDict, Union\n\n",
        "#: A path.\nPath = Union[str, os.PathLike[str]]\n",
        "#: A value as the command line takes it: text with a unit, or a number.\nText = Union[str, float, tuple[float, ...]]\n",
        "#: A number in the unit of the keyword, or several where the value has several.\nNumbers = Union[float, tuple[float, ...]]\n",
    ]
    bench = [option for option in _listed.settings().options if option.flag != "ignore-memory"]
    parts.append("\n\n" + keywords("Settings", "Everything that shapes a block.", bench))
    more = [option for option in _listed.settings().options if option.flag == "ignore-memory"]
    head = "class DesignOptions(Settings, total=False):"
    parts.append(
        "\n\n"
        + keywords("DesignOptions", "The keywords of design.", more).replace(
            "class DesignOptions(TypedDict, total=False):", head
        )
    )
    for name, command in commands.items():
        if name == "design" or not command.options or CALLS[name] != name:
            continue
        about = f"The keywords of {CALLS[name]}: `glasswarp {' '.join(command.words)}`."
        own = {
            of: [option for option in command.options if call(name, option) == of] for of in (name, "photons", "program")
        }
        parts.append("\n\n" + keywords(f"{name.title()}Options", about, own[name]))
        for of in ("photons", "program"):
            # The tally is no keyword there.
            more = [option for option in own[of] if option.flag != "tally"]
            if more:
                kind = f"{of.title()}Options"
                parts.append(
                    "\n\n" + keywords(kind, f"The keywords of {of}.", more).replace("(TypedDict", "(VerifyOptions")
                )
    return "".join(parts)


# --- records


def held(schema: dict[str, Any]) -> str:
    """The type of a field."""
    if "$ref" in schema:
        return str(schema["$ref"].rsplit("/", 1)[1])
    if "anyOf" in schema:
        kinds = [held(one) for one in schema["anyOf"]]
        known = [one for one in kinds if one != "None"]
        one = known[0] if len(known) == 1 else f"Union[{', '.join(known)}]"
        return f"Optional[{one}]" if "None" in kinds else one
    names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    plain = {"string": "str", "integer": "int", "number": "float", "boolean": "bool"}
    if names == ["null"]:
        return "None"
    known = [f"tuple[{held(schema['items'])}, ...]" if name == "array" else plain[name] for name in names if name != "null"]
    return f"Optional[{known[0]}]" if "null" in names else known[0]


def record(name: str, schema: dict[str, Any]) -> str:
    lines = ["@dataclass(frozen=True)", f"class {name}(Record):", wrapped(schema["description"], "    ", '"""') + '"""', ""]
    for key, of in sorted(schema["properties"].items()):
        lines += [wrapped(of["description"], "    #: "), f"    {key}: {held(of)}"]
    return "\n".join(lines) + "\n"


def records_file() -> str:
    schema = json.loads((DOCS / "glasswarp.schema.json").read_text())
    kinds = {name: of for name, of in schema["$defs"].items() if "properties" in of and name != "Fault"}
    parts = [
        MADE.format(about="What calls return, as typed records. None stands for what is not known or not finite."),
        "from dataclasses import dataclass\nfrom typing import Optional\n\nfrom ._record import Record\n",
    ]
    parts += ["\n\n" + record(name, of) for name, of in sorted(kinds.items())]
    results = [one["$ref"].rsplit("/", 1)[1] for one in schema["$defs"]["Result"]["anyOf"]]
    parts.append(f"\n\n#: What commands return.\nRESULTS: tuple[type[Record], ...] = ({', '.join(results)})\n")
    return "".join(parts)


# --- the table of options


def table() -> str:
    lines = []
    for name, command in _listed.commands().items():
        words = " ".join(command.words)
        lines += [
            "",
            f"### `glasswarp {words}`",
            "",
            f"{command.about}.",
            "",
            "| option | in Python | default |",
            "|---|---|---|",
        ]
        if command.positionals:
            shown = ", ".join(command.positionals)
            first = "design" if name == "design" else CALLS[name]
            lines.append(f"| `{shown.upper()}` | first argument of `{first}` | |")
        for option in command.options:
            spelled = f"`{call(name, option)}(..., {option.keyword}=...)`"
            spelled += f' or `{option.bare}="..."` with a unit' if option.unit else ""
            lines.append(f"| `--{option.flag}` | {spelled} | {shown_default(option)} |")
    lines += ["", "### For every command", "", "| option | in Python |", "|---|---|"]
    lines += [f"| `--{flag}` | {instead} |" for flag, instead in _listed.NOT_KEYWORDS.items()]
    return "\n".join(lines).strip() + "\n"


def shown_default(option: _listed.Option) -> str:
    if option.default is not None:
        return f"`{option.default}`"
    words = " ".join(option.help.split())
    return words.rsplit("[default: ", 1)[1].split("]")[0].replace("|", "\\|") if "[default: " in words else ""


BEGIN, END = "<!-- options: python/generate.py -->", "<!-- end of options -->"


def page() -> str:
    path = DOCS / "python.md"
    text = path.read_text()
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{table()}{END}{after}"


def main() -> int:
    files = {
        FOLDER / "glasswarp" / "_keywords.py": keywords_file(),
        FOLDER / "glasswarp" / "_records.py": records_file(),
        DOCS / "python.md": page(),
    }
    if "--check" not in sys.argv[1:]:
        for path, text in files.items():
            path.write_text(text)
        return 0
    stale = [path.name for path, text in files.items() if path.read_text() != text]
    if stale:
        print(f"python/generate.py has to be run: {', '.join(stale)}", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
