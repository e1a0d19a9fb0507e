"""Every command and option, as the library lists them, and keywords as the words of a command."""

from __future__ import annotations

import difflib
import functools
import json
import keyword as reserved
import operator
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Optional

from . import _glasswarp
from ._errors import BadInput, UnknownSetting

#: Flags of the command that mean nothing to a call, and what there is instead.
NOT_KEYWORDS = {
    "json": "every call returns its record",
    "verbose": "a record holds everything; `python -m glasswarp -v` traces stages and times",
    "help": "`help(glasswarp)`",
    "version": "`glasswarp.__version__`",
}

_UNITS = ("mm_per_min", "mm", "um", "deg", "nm")
_WRITTEN = {"mm_per_min": "mm/min"}


@dataclass(frozen=True)
class Option:
    """An option of a command."""

    flag: str
    kind: str
    unit: Optional[str]
    separator: str
    several: bool
    choices: tuple[str, ...]
    default: Optional[str]
    help: str
    is_setting: bool

    @property
    def bare(self) -> str:
        """Its keyword without a unit."""
        name = self.flag.replace("-", "_")
        return name + "_" if reserved.iskeyword(name) else name

    @property
    def keyword(self) -> str:
        """Its keyword, with the unit of its number if it has one."""
        return f"{self.bare}_{self.unit}" if self.unit else self.bare


@dataclass(frozen=True)
class Command:
    """A command: `words` call it, `options` go by every keyword that they have."""

    words: tuple[str, ...]
    about: str
    positionals: tuple[str, ...]
    options: tuple[Option, ...]

    @functools.cached_property
    def by_keyword(self) -> Mapping[str, Option]:
        named = {option.bare: option for option in self.options}
        named.update((option.keyword, option) for option in self.options)
        return named


@functools.lru_cache(maxsize=1)
def commands() -> Mapping[str, Command]:
    """All commands, by name."""
    listed = json.loads(_glasswarp.listed())
    settings = frozenset(listed["settings"])
    top = listed["command"]
    everywhere = [one for one in top["arguments"] if one["flag"] not in NOT_KEYWORDS]

    def option(one: Mapping[str, Any], of_design: bool) -> Option:
        return Option(
            flag=one["flag"],
            kind=one["kind"],
            unit=one["unit"],
            separator=one["separator"],
            several=one["several"],
            choices=tuple(one["choices"]),
            default=one["default"],
            help=one["help"] or "",
            is_setting=of_design and one["name"] in settings,
        )

    def command(listed: Mapping[str, Any], before: tuple[str, ...]) -> Iterable[tuple[str, Command]]:
        words = (*before, listed["name"])
        of_design = listed["name"] in ("design", "preview")
        flags = [one for one in listed["arguments"] if one["flag"] and one["flag"] not in NOT_KEYWORDS]
        yield (
            listed["name"],
            Command(
                words=words,
                about=listed["about"] or "",
                positionals=tuple(one["name"] for one in listed["arguments"] if not one["flag"]),
                options=tuple(option(one, of_design) for one in [*flags, *everywhere]),
            ),
        )
        for one in listed["commands"]:
            yield from command(one, words)

    return {name: one for top_level in top["commands"] for name, one in command(top_level, ())}


def settings() -> Command:
    """The settings of a block, which `glasswarp design` takes."""
    design = commands()["design"]
    own = tuple(option for option in design.options if option.is_setting or option.flag == "ignore-memory")
    return Command(design.words, design.about, design.positionals, own)


@functools.lru_cache(maxsize=1)
def _spellings() -> Mapping[str, str]:
    spelled: dict[str, str] = {}
    for command in commands().values():
        for option in command.options:
            spelled.setdefault(option.flag, option.keyword)
    return spelled


def spelling(flag: str) -> Optional[str]:
    """The keyword of a flag, without its dashes; none if there is no such flag."""
    return _spellings().get(flag)


def bare(keyword: str) -> str:
    """A keyword without its unit."""
    for unit in _UNITS:
        if keyword.endswith("_" + unit):
            return keyword[: -len(unit) - 1]
    return keyword


def _refused(keyword: str, value: Any, takes: str) -> BadInput:
    return BadInput(f"{keyword} takes {takes}, not {value!r}", setting=keyword, value=value)


def _number(keyword: str, value: Any, takes: str) -> str:
    if isinstance(value, (bool, str, bytes)):
        raise _refused(keyword, value, takes)
    try:
        return str(operator.index(value))
    except TypeError:
        pass
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise _refused(keyword, value, takes) from None


def _text(option: Option, keyword: str, value: Any) -> str:
    """A value as the command line takes it."""
    if option.kind == "switch":
        if not isinstance(value, bool):
            raise _refused(keyword, value, "True or False")
        return "true" if value else "false"
    if option.unit and keyword == option.keyword:
        unit = _WRITTEN.get(option.unit, option.unit)
        other = option.bare
        takes = f"a number of {unit}; text with a unit goes by the keyword {other}"
        numbers = value if isinstance(value, (tuple, list)) else [value]
        return option.separator.join(_number(keyword, one, takes) + unit for one in numbers)
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if option.kind == "path":
        raise _refused(keyword, value, "a path")
    if isinstance(value, (tuple, list)):
        return option.separator.join(_text(option, keyword, one) for one in value)
    return _number(keyword, value, "text or a number" if option.kind == "text" else "a number")


def flags(command: Command, given: Mapping[str, Any]) -> dict[str, list[str]]:
    """What keywords ask for, as flags of a command by their names. None stands for what is not said.

    Raises:
        UnknownSetting: A keyword that the command does not have.
        BadInput: A value of another type, one option given twice.
    """
    words: dict[str, list[str]] = {}
    by: dict[str, str] = {}
    for keyword, value in given.items():
        option = command.by_keyword.get(keyword)
        if option is None:
            near = difflib.get_close_matches(keyword, list(command.by_keyword), n=1, cutoff=0.6)
            hint = f"; did you mean {near[0]}?" if near else ""
            name = " ".join(command.words)
            raise UnknownSetting(f"{name} has no setting {keyword}{hint}", setting=keyword, value=value)
        if value is None:
            continue
        if option.flag in by:
            raise BadInput(f"{keyword} says what {by[option.flag]} says already", setting=keyword, value=value)
        by[option.flag] = keyword
        if option.kind == "flag":
            if not isinstance(value, bool):
                raise _refused(keyword, value, "True or False")
            words[option.flag] = [f"--{option.flag}"] if value else []
        elif option.several and isinstance(value, (list, tuple, set, frozenset)):
            words[option.flag] = [f"--{option.flag}={_text(option, keyword, one)}" for one in value]
        else:
            words[option.flag] = [f"--{option.flag}={_text(option, keyword, value)}"]
    return words


def in_words(flagged: Mapping[str, list[str]]) -> list[str]:
    """Flags one after another."""
    return [word for words in flagged.values() for word in words]
