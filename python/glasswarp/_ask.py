"""Commands, asked."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _glasswarp, _listed, _records
from ._errors import FellShort, GlasswarpError, GlasswarpWarning, exception_of, in_keywords, with_given
from ._progress import Progress, Told
from ._record import Record, of_dict

#: Light on the receiver: one number for every pixel, top row first.
Light = npt.NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]


def _result(found: Optional[Mapping[str, Any]]) -> Optional[Record]:
    if found is None:
        return None
    kind = next(one for one in _records.RESULTS if set(found) == set(one.__dataclass_fields__))
    return of_dict(kind, found)


def warn(words: Sequence[str], level: int) -> None:
    """Warns of everything that was found on the way."""
    for text in words:
        warnings.warn(in_keywords(text), GlasswarpWarning, stacklevel=level + 1)


def ask(
    name: str,
    positionals: Sequence[Path],
    given: Mapping[str, Any],
    progress: Progress = None,
    *,
    answers: bool = False,
    level: int = 3,
) -> tuple[Record, dict[str, Light]]:
    """Runs a command; `answers` says that falling short is an answer, and no error.

    Returns its record and the light that it has seen, by name.
    """
    command = _listed.commands()[name]
    flags = _listed.in_words(_listed.flags(command, given))
    words = [*command.words, *flags, "--", *(os.fspath(one) for one in positionals)]
    try:
        with Told(progress) as listener:
            text, lights = _glasswarp.ask(words, listener)
    except GlasswarpError as error:
        raise with_given(error, given) from None
    document = json.loads(text)
    warn(document["warnings"], level + 1)
    result, fault = _result(document["result"]), document["error"]
    if fault is not None:
        failed = with_given(exception_of(fault["kind"], fault["message"], fault["causes"]), given)
        if isinstance(failed, FellShort):
            if answers and result is not None:
                return result, dict(lights)
            failed.result = result
        raise failed
    if result is None:
        raise GlasswarpError(f"{name} has found nothing")
    return result, dict(lights)
