"""Every option of the command line has a keyword, and the files that say so are current."""

from __future__ import annotations

import inspect
import json
import pathlib
import subprocess
import sys
import typing

import pytest

import glasswarp as gw
from glasswarp import _errors, _glasswarp, _keywords, _listed

REPOSITORY = pathlib.Path(__file__).parents[2]


def everything() -> list[tuple[str, str]]:
    """Every command and flag, straight from the library."""

    def of(command: dict[str, typing.Any]) -> typing.Iterator[tuple[str, str]]:
        yield from ((command["name"], one["flag"]) for one in command["arguments"] if one["flag"])
        for one in command["commands"]:
            yield from of(one)

    return list(of(json.loads(_glasswarp.listed())["command"]))


def test_what_is_generated_is_current() -> None:
    made = subprocess.run(
        [sys.executable, REPOSITORY / "python" / "generate.py", "--check"], capture_output=True, text=True
    )
    assert made.returncode == 0, made.stderr


def test_every_option_stands_in_the_table() -> None:
    page = (REPOSITORY / "docs" / "python.md").read_text()
    sections = {part.split("`", 2)[1]: part for part in page.split("### ")[1:] if part.startswith("`")}
    everywhere = page.split("### For every command")[1]
    assert len(everything()) > 150
    for command, flag in everything():
        words = "glasswarp" if command == "glasswarp" else " ".join(["glasswarp", *_listed.commands()[command].words])
        part = everywhere if flag in _listed.NOT_KEYWORDS else sections.get(words)
        if command == "glasswarp" and flag not in _listed.NOT_KEYWORDS:
            continue  # Options of all commands stand with every one of them.
        assert part is not None and f"`--{flag}`" in part, (command, flag)


def test_an_option_without_a_keyword_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = json.loads(_glasswarp.listed())
    check = next(one for one in listed["command"]["commands"] if one["name"] == "check")
    check["arguments"].append({**check["arguments"][1], "name": "novel", "flag": "novel"})
    monkeypatch.setattr(_glasswarp, "listed", lambda: json.dumps(listed))
    _listed.commands.cache_clear()
    try:
        sys.path.insert(0, str(REPOSITORY / "python"))
        import generate

        files = {"python.md": generate.table(), "_keywords.py": generate.keywords_file()}
        assert "novel" in files["_keywords.py"] and "`--novel`" in files["python.md"]
        assert files["python.md"] not in (REPOSITORY / "docs" / "python.md").read_text()
    finally:
        _listed.commands.cache_clear()


def test_every_keyword_is_typed() -> None:
    typed = {
        "preview": _keywords.PreviewOptions,
        "check": _keywords.CheckOptions,
        "mill": _keywords.MillOptions,
        "ready": _keywords.ReadyOptions,
        "coupon": _keywords.CouponOptions,
        "crosscheck": _keywords.CrosscheckOptions,
        "merge": _keywords.MergeOptions,
    }
    for name, kind in typed.items():
        assert set(typing.get_type_hints(kind)) == set(_listed.commands()[name].by_keyword), name
    verify = set(typing.get_type_hints(_keywords.ProgramOptions)) | set(typing.get_type_hints(_keywords.PhotonsOptions))
    sweep = set(inspect.signature(gw.sweep).parameters)
    assert set(_listed.commands()["verify"].by_keyword) - verify - sweep == {"tally", "sweep"}
    assert set(typing.get_type_hints(_keywords.DesignOptions)) == set(_listed.settings().by_keyword)


def test_options_arrive_as_they_are_meant() -> None:
    design = _listed.settings()

    def words(**given: typing.Any) -> list[str]:
        return _listed.in_words(_listed.flags(design, given))

    assert words(size_mm=80) == ["--size=80mm"] and words(size=80) == ["--size=80"] and words(size="8cm") == ["--size=8cm"]
    assert words(shift_mm=(25, -10.5)) == ["--shift=25mm,-10.5mm"] and words(shift="1mm,2mm") == ["--shift=1mm,2mm"]
    assert words(tilt_deg=(30, 90)) == ["--tilt=30deg,90deg"] and words(wavelength_nm=532) == ["--wavelength=532nm"]
    assert words(mirror=True) == ["--mirror=true"] and words(mirror=False) == ["--mirror=false"]
    assert words(ignore_memory=True) == ["--ignore-memory"] and words(ignore_memory=False) == []
    assert words(crop=(10, 20, 30, 40)) == ["--crop=10,20,30,40"] and words(nodes=None) == []
    verify = _listed.commands()["verify"]
    given = {"output": ["a.png", pathlib.Path("b.exr")], "window_mm": (30, 20), "rapid_mm_per_min": 3000}
    assert _listed.in_words(_listed.flags(verify, given)) == [
        "--output=a.png",
        "--output=b.exr",
        "--window=30mmx20mm",
        "--rapid=3000mm/min",
    ]
    assert "with_" in _listed.commands()["crosscheck"].by_keyword


def test_messages_speak_of_keywords() -> None:
    assert _errors.in_keywords("leave `ior` out (`max-slope`)") == "leave ior out (max_slope_deg)"
    assert _errors.in_keywords("take at most `nodes 512`, or --offset") == "take at most nodes=512, or offset"
    assert _errors.in_keywords("missing field `bread` of a--size") == "missing field `bread` of a--size"
