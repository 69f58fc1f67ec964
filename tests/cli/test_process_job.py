"""A farm's job has the options of the command that writes it."""

from argparse import ArgumentParser

import pytest
from command_parsers import command_parsers

from usdface.cli.process import _OF_RESULT
from usdface.cli.process_job import job_words


def words(parser: ArgumentParser, *given: str) -> tuple[list[str], list[str]]:
    """The words of all steps, and those of the last, of `usdface process ...`."""
    parsed = parser.parse_args(["shot.usda", "--pieces", "p", "--openjd", "job", *given])
    return job_words(parsed, apart=_OF_RESULT), job_words(parsed, only=_OF_RESULT)


@pytest.mark.parametrize(
    "given",
    [
        ["--no-express"],
        ["--no-clean"],
        ["--solve=frame"],
        ["--exaggeration=brows=1.5"],
        ["--asset-root=textures"],
        ["--skip-hook", "a", "--skip-hook", "b"],
        ["--trusted"],
    ],
)
def test_every_step_has_the_options_of_the_run(given: list[str]) -> None:
    assert words(command_parsers()["process"], *given) == (given, [])


@pytest.mark.parametrize(
    "given",
    [
        ["--gltf=a.glb"],
        ["--output=a.usda"],
        ["--deliver=a.usdc", "--start=-3", "--handles=2", "--rate=24.0"],
        ["--cache=c"],
        ["--overwrite"],
        ["--strict"],
    ],
)
def test_the_last_step_has_those_of_the_result(given: list[str]) -> None:
    of_steps, of_last = words(command_parsers()["process"], *given)
    assert of_steps == [] and sorted(of_last) == sorted(given)


def test_what_is_not_given_and_what_is_of_the_job_is_not_repeated() -> None:
    given = ["--chunk", "4", "--report", "r.json", "--format", "json", "--progress", "none"]
    assert words(command_parsers()["process"], *given, "--debug") == ([], [])


def test_a_new_option_reaches_the_farm() -> None:
    """An option that a list forgot was without effect there."""
    parser = command_parsers()["process"]
    parser.add_argument("--new", type=float)
    assert words(parser, "--new", "2") == (["--new=2.0"], [])
