import ast
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

import usdface

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


def test_all_is_sorted_and_complete() -> None:
    homes = [name for names in usdface._HOMES.values() for name in names]
    assert usdface.__all__ == sorted(homes)
    assert set(usdface.__all__) <= set(dir(usdface))


@pytest.mark.parametrize("home", usdface._HOMES)
def test_every_name_is_public_at_home(home: str) -> None:
    module = import_module(f"usdface.{home}")
    for name in usdface._HOMES[home]:
        assert name in module.__all__
        assert getattr(usdface, name) is getattr(module, name)


def test_every_error_is_exported() -> None:
    from usdface import errors

    kinds = {name for name in errors.__all__ if name.endswith("Error")}
    assert kinds <= set(usdface.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        usdface.nonsense  # noqa: B018


def test_star_import_gives_exactly_all() -> None:
    names: dict[str, object] = {}
    exec("from usdface import *", names)
    assert set(names) - {"__builtins__"} == set(usdface.__all__)


def test_the_version_has_one_source() -> None:
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "usdface.__version__"}


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(Path(usdface.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    homes = {
        str(node.module).removeprefix("usdface."): tuple(alias.name for alias in node.names)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
    }
    assert homes == usdface._HOMES
