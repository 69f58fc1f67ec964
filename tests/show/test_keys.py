"""Keys of results: the program itself, and functions of other packages."""

from importlib import invalidate_caches
from pathlib import Path

import pytest
from other_packages import Install, install

from usdface.show.keys import program, source_digest

__all__ = ["install"]


def test_what_a_run_compiles_is_no_part_of_the_program(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text("x = 1\n")
    before = source_digest(tmp_path)
    cache = tmp_path / "inner" / "__pycache__"
    cache.mkdir(parents=True)
    for name in ("module.cpython-311.pyc", "module.f-1.py311.nbi", "module.f-1.py311.1.nbc"):
        (cache / name).write_bytes(b"compiled")
    assert source_digest(tmp_path) == before


@pytest.mark.parametrize("change", ["x = 2\n", "x = 1 \n"])
def test_a_byte_of_the_program_changes_its_key(tmp_path: Path, change: str) -> None:
    (tmp_path / "module.py").write_text("x = 1\n")
    before = source_digest(tmp_path)
    (tmp_path / "module.py").write_text(change)
    assert source_digest(tmp_path) != before


def key() -> dict[str, object]:
    invalidate_caches()
    program.cache_clear()
    return program()


HOOK = """def weights_solved(weights, shot):
    return weights
"""


def test_the_source_code_of_a_hook_counts(install: Install) -> None:
    place = install("acme", HOOK, {"usdface.hooks": {"weights_solved": "acme:weights_solved"}})
    try:
        before = key()
        assert any("acme:weights_solved 1.0" in each for each in before["plugins"])
        assert key() == before
        (place / "acme.py").write_text(HOOK.replace("return weights", "return None"))
        assert key()["plugins"] != before["plugins"]
    finally:
        program.cache_clear()
