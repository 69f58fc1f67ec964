import ast
import tomllib
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import usdface
import usdface.pipeline

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


PACKAGES = (usdface, usdface.pipeline)
HOMES = [(package, home) for package in PACKAGES for home in package._HOMES]


@pytest.mark.parametrize("package", PACKAGES)
def test_all_is_sorted_and_complete(package: ModuleType) -> None:
    homes = [name for names in package._HOMES.values() for name in names]
    lists = f"__all__ and _HOMES of {package.__name__}"
    assert not set(package.__all__) ^ set(homes), f"{lists} have not the same names"
    assert package.__all__ == sorted(homes), f"{lists}: in order"
    assert set(package.__all__) <= set(dir(package))


@pytest.mark.parametrize(("package", "home"), HOMES)
def test_every_name_is_public_at_home(package: ModuleType, home: str) -> None:
    module = import_module(f"{package.__name__}.{home}")
    for name in package._HOMES[home]:
        assert name in module.__all__
        assert getattr(package, name) is getattr(module, name)


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


def test_the_licence_is_an_expression() -> None:
    """As a table it ends builds, from setuptools of 2027-02-18 on (PEP 639)."""
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    assert project["project"]["license"] == "Apache-2.0"
    assert project["build-system"]["requires"] == ["setuptools>=77"]  # from which on it reads one


@pytest.mark.parametrize("package", PACKAGES)
def test_type_checkers_see_the_same_names(package: ModuleType) -> None:
    tree = ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    homes = {
        str(node.module).removeprefix(f"{package.__name__}."): tuple(a.name for a in node.names)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
    }
    for home in {*homes, *package._HOMES}:
        both = homes.get(home, ()), tuple(package._HOMES.get(home, ()))
        assert both[0] == both[1], f"{package.__name__}: TYPE_CHECKING and _HOMES have {both}"
