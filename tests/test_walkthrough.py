"""The tutorial and the recipes are followed, command by command; each prints what they show."""

import shutil
from pathlib import Path

import pytest
from chromium import chromium_path, open_browser

ROOT = Path(__file__).parents[1]


@pytest.fixture
def from_docs(monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in (ROOT, ROOT / "docs"):
        monkeypatch.syspath_prepend(folder)


@pytest.mark.parametrize(
    ("shown", "missing"),
    [
        ("markers 42\nverdict: good", ""),
        ("verdict: good\nmarkers 42", "markers 42"),
        ("markers 46", ""),
        ("markers 47", "markers 47"),
        ("...good", ""),
        ("verdict: ...", ""),
        ("wrote a.usda", "wrote a.usda"),
    ],
)
def test_shown_lines_are_found_in_their_order(from_docs: None, shown: str, missing: str) -> None:
    from walkthrough import shows

    assert shows("  markers   42 \nresidual 0.3\nverdict: good\n", shown) == missing


def test_a_command_that_fails_or_prints_something_else_is_found(
    from_docs: None, tmp_path: Path
) -> None:
    from walkthrough import follow

    page, drawn = tmp_path / "page.md", []
    page.write_text("```sh\necho 3 > n; cat n\n```\n![seen](n.png)\n```text\n3\n```\n")
    follow(page, tmp_path, drawn.append)
    assert drawn == ["n.png"] and (tmp_path / "n").read_text() == "3\n"
    for wrong in ("```sh\nfalse\n```\n", "```sh\necho 3\n```\n```text\n4\n```\n"):
        page.write_text(wrong)
        with pytest.raises(AssertionError):
            follow(page, tmp_path, drawn.append)


@pytest.mark.slow
def test_the_recipes_are_true(from_docs: None, tmp_path: Path) -> None:
    from walkthrough import follow

    from examples.recipe_files import make_recipe_files

    make_recipe_files(tmp_path)
    follow(ROOT / "docs" / "recipes.md", tmp_path, lambda name: None)
    assert "gain" in (tmp_path / "anna.json").read_text()  # no later recipe wrote over it


@pytest.mark.slow
def test_the_tutorial_is_true(from_docs: None, tmp_path: Path) -> None:
    executable = chromium_path()
    if not executable or not shutil.which("bash"):
        pytest.skip("chromium is not installed; .ci/run installs it")
    from make_screens import follow_tutorial

    with open_browser(executable, tmp_path) as browser:
        pictures = follow_tutorial(browser, tmp_path)
    assert len(pictures) == 4
    assert all(picture.startswith(b"\x89PNG") for picture in pictures.values())
