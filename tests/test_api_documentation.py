"""Every public name is documented, with an example that runs; docs/api.md shows them all."""

import doctest
import importlib
import inspect
import re
import shutil
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

import usdface

ROOT = Path(__file__).parents[1]
FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL | doctest.NORMALIZE_WHITESPACE
NAMES = pytest.mark.parametrize("name", usdface.__all__)

# Their examples solve the example's take, which takes seconds.
SOLVE = {
    *("Explanation", "PlayedShot", "ShotResult", "apply", "calibrate", "check_neutral", "correct"),
    *("explain", "explain_result", "peak_frames", "process", "process_sequence", "read_result"),
    *("residual_colours", "retarget", "set_up", "solve_pieces", "view"),
}


@pytest.fixture
def beside_the_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n in SOLVE else []) for n in usdface.__all__],
)
def test_its_example_runs(name: str, beside_the_examples: Path) -> None:
    public = getattr(usdface, name)
    text = inspect.getdoc(public) or ""
    test = doctest.DocTestParser().get_doctest(
        text, {"usdface": usdface, "np": np, "Path": Path, "Usd": Usd}, name, None, 0
    )
    assert test.examples, f"{name} has no example"
    result: list[str] = []
    doctest.DocTestRunner(optionflags=FLAGS).run(test, out=result.append)
    assert not result, "".join(result)


INTERNAL = [path for path in sorted((ROOT / "usdface").rglob("*.py")) if ">>> " in path.read_text()]


@pytest.mark.slow
def test_examples_of_names_that_are_not_public_run_too() -> None:
    """Of functions and of modules; those of public names are run above."""
    run, wrong = 0, list[str]()
    for path in INTERNAL:
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        for test in doctest.DocTestFinder().find(module, extraglobs={"usdface": usdface}):
            if test.examples and test.name.rsplit(".", 1)[-1] not in usdface.__all__:
                run += 1
                doctest.DocTestRunner(optionflags=FLAGS).run(test, out=wrong.append)
    assert run > 3 and not wrong, "".join(wrong)


@NAMES
def test_each_parameter_is_described(name: str) -> None:
    public = getattr(usdface, name)
    text = inspect.getdoc(public) or ""
    described = text.split("Parameters\n-----", 1)[-1] if "Parameters\n" in text else text
    for parameter in inspect.signature(public).parameters:
        if parameter not in ("args", "kwargs"):
            assert parameter in described, f"{name}: {parameter}"


@NAMES
def test_only_the_first_arguments_of_a_function_go_by_place(name: str) -> None:
    public = getattr(usdface, name)
    if inspect.isfunction(public):
        kinds = [p.kind for p in inspect.signature(public).parameters.values()]
        assert kinds.count(inspect.Parameter.POSITIONAL_OR_KEYWORD) <= 3
        assert inspect.signature(public).return_annotation is not inspect.Signature.empty


@NAMES
def test_a_type_of_results_cannot_be_changed(name: str) -> None:
    public = getattr(usdface, name)
    if is_dataclass(public):
        assert public.__dataclass_params__.frozen and fields(public)


def test_the_page_shows_every_name_once() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\.\. auto(function|class|exception):: (\w+)$", page, re.MULTILINE)
    names = [name for _, name in shown]
    assert not {*usdface.__all__} - {*names}, "write `.. autofunction:: NAME` into docs/api.md"
    assert sorted(names) == sorted(usdface.__all__)
    for kind, name in shown:
        assert inspect.isfunction(getattr(usdface, name)) == (kind == "function"), name
