"""Paths relative to a folder, and what stands in for them between drives."""

import os
from pathlib import Path

import pytest

from usdface.io.relative_path import relative_path
from usdface.io.usd.save_layers import relative_asset


def test_relative_to_a_folder(tmp_path: Path) -> None:
    assert relative_path(tmp_path / "rigs" / "head.usdc", tmp_path) == "rigs/head.usdc"
    assert relative_path(tmp_path / "head.usdc", tmp_path / "shots") == "../head.usdc"


def test_absolute_on_another_drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_way(path: object, start: object = None) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")  # as ntpath.relpath

    monkeypatch.setattr(os.path, "relpath", no_way)
    rig = tmp_path.resolve() / "head.usdc"
    assert relative_path(rig, tmp_path / "shots") == str(rig)
    assert relative_asset(rig, tmp_path / "shots" / "shot.usda") == str(rig)
