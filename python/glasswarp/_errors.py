"""What goes wrong, as exceptions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Optional


class GlasswarpError(Exception):
    """What every exception of glasswarp is.

    Attributes:
        message: What happened, why, and what helps.
        setting: The keyword that it is about, if it is about one.
        value: What was given for it, if anything was.
        causes: Why it happened, the nearest cause first.
    """

    def __init__(
        self,
        message: str,
        *,
        setting: Optional[str] = None,
        value: Any = None,
        causes: Sequence[str] = (),
    ) -> None:
        super().__init__(message)
        self.message = message
        self.setting = setting
        self.value = value
        self.causes = tuple(causes)

    def __str__(self) -> str:
        return "\n  because: ".join([self.message, *self.causes])

    def __reduce__(self) -> tuple[Any, ...]:
        return (_again, (type(self), self.message, self.__dict__))


def _again(kind: type[GlasswarpError], message: str, attributes: Mapping[str, Any]) -> GlasswarpError:
    error = kind(message)
    error.__dict__.update(attributes)
    return error


class BadInput(GlasswarpError, ValueError):
    """The request makes no sense, or physics forbids it (exit code 2 of the command)."""


class UnknownSetting(BadInput, TypeError):
    """A keyword that the call does not have; the message names what is most like it."""


class FileError(GlasswarpError, OSError):
    """A file cannot be read or written (exit code 1)."""


class NotASolid(BadInput):
    """The mesh is no closed, oriented solid (exit code 4)."""


class FellShort(GlasswarpError):
    """A limit that was asked for is not kept (exit code 3).

    Attributes:
        result: What was found all the same, if anything was.
    """

    result: Any = None


class GlasswarpWarning(UserWarning):
    """What went well and may not be what was meant."""


_KINDS: Mapping[str, type[GlasswarpError]] = {
    "file": FileError,
    "refused": BadInput,
    "fell-short": FellShort,
    "invalid-mesh": NotASolid,
}

_SETTING = re.compile(r"`(?P<quoted>[a-z][a-z-]*)(?: (?P<value>[^`]*))?`|(?<![\w-])--(?P<flag>[a-z][a-z-]+)")


def in_keywords(text: str) -> str:
    """A message of the library, with its settings as keywords."""
    return _spelled(text)[0]


def _spelled(text: str) -> tuple[str, Optional[str]]:
    """The same, and the first keyword of which it speaks."""
    from ._listed import spelling

    first: Optional[str] = None

    def keyword(found: re.Match[str]) -> str:
        nonlocal first
        name = spelling(found["quoted"] or found["flag"])
        if name is None:
            return found[0]
        first = first or name
        return f"{name}={found['value']}" if found["value"] else name

    return _SETTING.sub(keyword, text), first


def exception_of(kind: str, message: str, causes: Sequence[str]) -> GlasswarpError:
    """The exception of a failure of the library."""
    text, setting = _spelled(message)
    return _KINDS.get(kind, GlasswarpError)(text, setting=setting, causes=[in_keywords(cause) for cause in causes])


def misuse_of(message: str, flag: Optional[str], value: Optional[str]) -> GlasswarpError:
    """The exception of words that are no command."""
    from ._listed import spelling

    # What follows is about the command line.
    said = re.split(r"\n\n(?:Usage|For more)", message, maxsplit=1)[0].strip()
    said = re.sub(r"^error: ", "", said)
    name = spelling(flag.split()[0].lstrip("-")) if flag else None
    if name is not None and value is not None:
        why = said.split(": ", 1)[1] if ": " in said else said
        return BadInput(in_keywords(f"{name}: {why}"), setting=name, value=value)
    return BadInput(in_keywords(said), setting=name, value=value)


def _tells(message: str, value: Any) -> bool:
    return any(number.rstrip(".") == f"{value}" for number in re.findall(r"-?[\d.]+", message))


def with_given(error: GlasswarpError, given: Mapping[str, Any]) -> GlasswarpError:
    """The same error, with what the caller gave for the setting that it is about."""
    from ._listed import bare

    for keyword, value in given.items():
        quoted = isinstance(value, str) and f"'{value}'" in error.message
        # A stage of the library speaks of "the distance to the receiver", and of its value.
        spoken = error.setting is None and keyword.split("_")[0] in error.message and _tells(error.message, value)
        if quoted or spoken or (error.setting is not None and bare(keyword) == bare(error.setting)):
            before = f"{error.setting}: "
            if error.message.startswith(before):
                error.message = f"{keyword}: {error.message[len(before) :]}"
            error.setting, error.value = keyword, value
            break
    return error
