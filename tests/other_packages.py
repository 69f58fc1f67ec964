"""Packages that add formats, installed as pip would: a module and its dist-info on the path."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """`install(name, source, entries)`: a distribution `name` 1.0 with a module of that name."""
    loaded = set(sys.modules)

    def installed(name: str, source: str, entries: Mapping[str, Mapping[str, str]]) -> Path:
        place = tmp_path / "site" / name
        write_distribution(place, name, source, entries)
        monkeypatch.syspath_prepend(str(place))
        return place

    yield installed
    for module in set(sys.modules) - loaded:
        if not module.startswith(("usdface", "pxr")):
            origin = getattr(sys.modules[module], "__file__", None) or ""
            if origin.startswith(str(tmp_path)):
                del sys.modules[module]


def write_distribution(
    place: Path, name: str, source: str, entries: Mapping[str, Mapping[str, str]]
) -> None:
    information = place / f"{name}-1.0.dist-info"
    information.mkdir(parents=True)
    (place / f"{name}.py").write_text(source, encoding="utf-8")
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = []
    for group, points in entries.items():
        lines += [f"[{group}]", *(f"{key} = {value}" for key, value in points.items())]
    (information / "entry_points.txt").write_text("\n".join(lines) + "\n")
