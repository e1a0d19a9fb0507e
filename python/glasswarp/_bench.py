"""Where block, light and receiver stand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional

from . import _glasswarp, _listed
from ._errors import GlasswarpError, with_given

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import Settings


class Bench:
    """A bench, and everything else that shapes a block: settings that are checked once, and do not change.

    Every setting of `glasswarp design` is a keyword, with the same default. Those with a unit take a number in it
    (`distance_mm=250`), or text with any unit by their bare name (`distance="25cm"`).

    >>> bench = Bench(size_mm=80, distance="20cm", material="bk7")
    >>> bench.size_mm, bench.distance_mm, bench.ior
    (80.0, 200.0, 1.5168)

    Raises:
        UnknownSetting: A keyword that is no setting.
        BadInput: A value that is none, or settings that exclude each other.
        FileError: A file that cannot be read.
    """

    __slots__ = ("_described", "_given")

    def __init__(self, **settings: Unpack[Settings]) -> None:
        given: dict[str, Any] = {name: value for name, value in settings.items() if value is not None}
        words = _listed.in_words(_listed.flags(_listed.settings(), given))
        try:
            described = json.loads(_glasswarp.bench(words))
        except GlasswarpError as error:
            raise with_given(error, given) from None
        self._given: Mapping[str, Any] = given
        self._described: Mapping[str, Any] = described

    @property
    def given(self) -> dict[str, Any]:
        """The keywords as they were given."""
        return dict(self._given)

    @property
    def settings(self) -> dict[str, Any]:
        """The settings by their names in design files, with those of the preset and the material."""
        return {name: value for name, value in self._described["settings"].items() if value is not None}

    @property
    def size_mm(self) -> float:
        """Width of the block, mm."""
        return float(self._described["size_mm"])

    @property
    def distance_mm(self) -> float:
        """From the mean plane of the exit face to the receiver, mm."""
        return float(self._described["distance_mm"])

    @property
    def ior(self) -> Optional[float]:
        """Refractive index; None of a mirror."""
        ior = self._described["ior"]
        return None if ior is None else float(ior)

    @property
    def mirror(self) -> bool:
        """Whether the face is a mirror."""
        return bool(self._described["mirror"])

    def replace(self, **settings: Unpack[Settings]) -> Bench:
        """Another bench, with these settings in place of its own."""
        return Bench(**merged(self._given, settings))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Bench) and self._described == other._described

    def __hash__(self) -> int:
        return hash(json.dumps(self._described, sort_keys=True))

    def __repr__(self) -> str:
        return f"Bench({', '.join(f'{name}={value!r}' for name, value in self._given.items())})"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_bench, (dict(self._given),))


def _bench(given: Mapping[str, Any]) -> Bench:
    return Bench(**given)


def merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Settings, and those that go before them, however they are spelled."""
    names = {_listed.bare(name) for name, value in over.items() if value is not None}
    kept = {name: value for name, value in under.items() if _listed.bare(name) not in names}
    return {**kept, **{name: value for name, value in over.items() if value is not None}}
