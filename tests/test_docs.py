"""What the documents show is true: commands, links, USD and Python."""

import ast
import doctest
import re
from pathlib import Path

import pytest
from pxr import Sdf, Usd

from usdface.io.usd.fuzzy import read_fuzzy

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path
    for folder in (ROOT, ROOT / "docs", ROOT / "plugins", ROOT / "examples")
    for path in folder.glob("*.md")
)
INSTALL_AND_TEST = (
    "python3 -m venv --without-pip .venv && "
    "python3 -m pip --python .venv/bin/python install -e '.[test]' && "
    ".venv/bin/pytest -n 2"
)
INSTALL_AND_PROCESS = (
    "python3 -m venv --without-pip .venv && "
    "python3 -m pip --python .venv/bin/python install . && "
    ".venv/bin/usdface process examples/shot.usda --gltf examples/face.glb"
)


@pytest.mark.parametrize("name", ["README.md", ".ci/run"])
def test_ci_runs_the_documented_first_command(name: str) -> None:
    assert INSTALL_AND_PROCESS in (ROOT / name).read_text(encoding="utf-8").splitlines()


def blocks(document: Path, language: str) -> list[str]:
    text = document.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", ".ci/run"])
def test_ci_runs_the_documented_test_command(name: str) -> None:
    assert INSTALL_AND_TEST in (ROOT / name).read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_modules_that_are_named_are_there(document: Path) -> None:
    for named in re.findall(r"`(usdface/[\w/]+\.py)`", document.read_text(encoding="utf-8")):
        assert (ROOT / named).is_file(), named


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text(encoding="utf-8")):
        if "://" not in target and not target.startswith("#"):
            assert (document.parent / target.partition("#")[0]).exists(), target


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_examples_parse(document: Path) -> None:
    for block in blocks(document, "usda"):
        assert Sdf.Layer.CreateAnonymous(".usda").ImportFromString(block)
    for block in blocks(document, "python"):
        ast.parse(block)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_sessions_are_true(document: Path) -> None:
    if document.name == "api.md":
        pytest.skip("tests/test_api_documentation.py runs its examples, where their files are")
    for block in blocks(document, "pycon"):
        session = doctest.DocTestParser().get_doctest(block, {}, document.name, str(document), 0)
        assert session.examples and not doctest.DocTestRunner().run(session).failed


def test_what_is_overridden_is_there() -> None:
    """The override that docs/usd.md shows names prims, attributes and variables of the example."""
    block = next(b for b in blocks(ROOT / "docs" / "usd.md", "usda") if "subLayers" in b)
    over = Sdf.Layer.CreateAnonymous(".usda")
    over.ImportFromString(block.replace("@shot.usda@", f"@{ROOT / 'examples' / 'shot.usda'}@"))
    stage = Usd.Stage.Open(over)
    shown = []
    over.Traverse("/", lambda path: shown.append(path))
    for path in shown:
        if path.IsPropertyPath():
            assert len(stage.GetAttributeAtPath(path).GetPropertyStack()) == 2, path
    read_fuzzy(stage, "/Shot/Fuzzy")
