from pathlib import Path

import pytest

from usdface.user_cache import user_cache_folder


def test_the_folder_lies_in_the_users_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert user_cache_folder("x") == Path.home() / ".cache" / "usdface" / "x"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache_folder("x") == tmp_path / "usdface" / "x"
    monkeypatch.setenv("XDG_CACHE_HOME", "not/absolute")
    assert user_cache_folder("x") == Path.home() / ".cache" / "usdface" / "x"
    assert not list(tmp_path.iterdir())


def test_a_user_without_a_home_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert user_cache_folder("x") is None
