from argparse import Namespace

import pytest

from usdface.cli import main
from usdface.cli.option_rules import check_together
from usdface.errors import InputError

NEEDS = {"chunk": "--openjd DIR", "no_cache": "--openjd DIR"}
EXCLUDES = {"openjd": ("watch", "no_cache")}
NOTHING = dict.fromkeys(("chunk", "no_cache", "watch"), None) | {"openjd": ""}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"chunk": 0}, "--chunk 0 needs --openjd DIR"),
        ({"openjd": "job", "no_cache": True}, "--openjd takes no --no-cache; leave it out"),
        (
            {"openjd": "job", "watch": True, "no_cache": True},
            "--openjd takes no --no-cache, --watch; leave it out",
        ),
    ],
)
def test_an_option_without_effect_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as refused:
        check_together(Namespace(**NOTHING | given), NEEDS, EXCLUDES)
    assert str(refused.value) == message


@pytest.mark.parametrize("given", [{}, {"openjd": "job", "chunk": 2}, {"watch": True}])
def test_others_are_not(given: dict[str, object]) -> None:
    check_together(Namespace(**NOTHING | given), NEEDS, EXCLUDES)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--piece 0", "--piece 0 needs --pieces DIR"),
        ("--pieces p --piece 0 --gltf face.glb --in-place", "takes no --gltf, --in-place"),
        ("--pieces p --openjd job --piece 0", "--openjd takes no --piece"),
    ],
)
def test_a_piece_alone_writes_no_result(
    options: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", "shot.usda", *options.split()]) == 1
    assert message in capsys.readouterr().err
