"""The documents are true: commands, links, USD and Python."""

import ast
import doctest
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
from command_parsers import command_parsers
from pxr import Sdf, Usd

from usdface.cli import _parser, main
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
    for block in blocks(document, "pycon"):
        session = doctest.DocTestParser().get_doctest(block, {}, document.name, str(document), 0)
        assert session.examples and not doctest.DocTestRunner().run(session).failed


def test_every_page_has_a_place_in_the_navigation_of_the_site() -> None:
    contents = (ROOT / "docs" / "site" / "contents.yml").read_text(encoding="utf-8")
    placed = re.findall(r"^ *(?:- file|root): (\S+)$", contents, re.MULTILINE)
    pages = [path.relative_to(ROOT).with_suffix("").as_posix() for path in DOCUMENTS]
    assert sorted(placed) == sorted([*pages, "benchmarks/README"])


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", ".ci/run"])
def test_ci_builds_the_site_with_the_documented_commands(name: str) -> None:
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    assert ".venv/bin/sphinx-build -q -W --keep-going -c docs/site . build/site" in lines


def command_lines(document: Path) -> list[list[str]]:
    text = "".join(blocks(document, "sh")).replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line.startswith("usdface ")]
    return [words for line in lines if "..." not in (words := shlex.split(line, comments=True))]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_commands_and_their_options_exist(document: Path) -> None:
    for words in command_lines(document):
        _parser().parse_args(words[1:])


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_options_that_a_sentence_names_are_of_their_command(document: Path) -> None:
    """Also of `shot --neutral`, without the program's name."""
    options = {
        name: set(parser._option_string_actions) for name, parser in command_parsers().items()
    }
    for code in re.findall(r"`(?:usdface )?([^`\n]+)`", document.read_text(encoding="utf-8")):
        group, _, rest = code.partition(" ")
        command = f"{group} {rest.split(' ')[0]}" if group == "fuzzy" else group
        named = set(re.findall(r"(?<![\w-])--[a-z][\w-]*", rest))
        assert command not in options or named <= options[command], code


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_attributes_that_are_named_exist(document: Path) -> None:
    files = [*(ROOT / "usdface").rglob("*.py"), ROOT / "usdface" / "schemas" / "schema.usda"]
    source = "".join(path.read_text(encoding="utf-8") for path in files)
    for name in re.findall(r"`(usdface:[\w:]*\w)`", document.read_text(encoding="utf-8")):
        a_pin = name.startswith("usdface:pin:")  # and the name of a blend shape
        assert a_pin or re.search(rf"{name}\b(?!:)", source), name


@pytest.mark.slow
def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    (block,) = blocks(ROOT / "README.md", "python")
    names: dict[str, Any] = {}
    exec(block, names)
    assert names["weights"].weights.shape == (720, 51)
    assert names["result"].written[0].is_file()


def python_of_usd(named: str) -> dict[str, Any]:
    """What the block of docs/usd.md that has a name defines when it is run."""
    (block,) = (b for b in blocks(ROOT / "docs" / "usd.md", "python") if named in b)
    names: dict[str, Any] = {}
    exec(block, names)
    return names


def test_fallback_types_are_authored_as_usd_md_shows() -> None:
    stage = python_of_usd("write_fallback_types")["stage"]
    types = stage.GetRootLayer().pseudoRoot.GetInfo("fallbackPrimTypes")
    assert list(types["UsdFaceMarkerTake"]) == ["Points"]


@pytest.mark.slow
def test_layers_are_muted_as_usd_md_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "examples", tmp_path, dirs_exist_ok=True)
    assert main(["process", str(tmp_path / "shot.usda")]) == 0
    monkeypatch.chdir(tmp_path)
    names = python_of_usd("MuteLayer")
    played = names["stage"].GetAttributeAtPath("/Shot/Character/Face/Anim.blendShapeWeights")
    strongest, *_ = played.GetPropertyStack(0.0)
    assert strongest.layer.GetDisplayName() == "solve.usdc"


def test_overridden_prims_and_attributes_exist() -> None:
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


def test_the_readme_names_every_extra_that_a_message_asks_for() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "usdface").rglob("*.py"))
    asked = set(re.findall(r"how_to_install\(['\"](\w+)['\"]\)", text))
    assert asked == {"compression", "movies", "otio", "plot"}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(f"`{extra}`" in readme for extra in asked)
    assert readme.index("`. .venv/bin/activate`") < readme.index("\nusdface rig")
    assert set(re.findall(r"install '\.\[(.*)\]'", readme)[0].split(",")) <= asked


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_packages_go_to_the_environment_of_the_readme(document: Path) -> None:
    """It has no pip of its own, and the pip of the system installs for another Python."""
    lines = [line for line in "".join(blocks(document, "sh")).splitlines() if "pip install" in line]
    assert all("--target" in line for line in lines), lines
