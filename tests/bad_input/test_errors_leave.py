"""How errors leave the program: one line, or all of it with --debug."""

import pytest
from checkout import run_usdface
from spoilt import Place, listing

from usdface.cli import main
from usdface.errors import UsdFaceError


def test_debug_raises_what_happened(place: Place) -> None:
    with pytest.raises(UsdFaceError, match=r"none\.usda"):
        main(["process", str(place / "none.usda"), "--debug"])


def test_a_mistake_of_the_program_is_one_line_too(
    place: Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("first\nsecond")

    monkeypatch.setattr("usdface.pipeline.process", broken)
    assert main([str(a) for a in place.process]) == 1
    assert capsys.readouterr().err == (
        "usdface: a mistake in usdface: ZeroDivisionError: first; --debug shows where\n"
    )
    with pytest.raises(ZeroDivisionError):
        main([*map(str, place.process), "--debug"])


def test_a_package_that_is_not_installed_is_named(
    place: Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*_: object, **__: object) -> None:
        raise ModuleNotFoundError("No module named 'numpy'", name="numpy")

    monkeypatch.setattr("usdface.pipeline.process", missing)
    assert main([str(a) for a in place.process]) == 1
    assert capsys.readouterr().err == (
        "usdface: the Python module numpy is not installed; `pip install usdface`, in a clone "
        "`pip install .`, installs all that usdface needs\n"
    )


def test_an_interrupted_run_says_so(
    place: Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    before = listing(place.folder)
    # After the first of three files was written to its temporary place.
    monkeypatch.setattr("usdface.io.usd.layers._root_layer", interrupted)
    assert main([str(a) for a in place.process]) == 130
    assert capsys.readouterr() == ("", "usdface: interrupted\n")
    assert listing(place.folder) == before


@pytest.mark.slow
def test_no_traceback_without_it(place: Place) -> None:
    given = ["take", str(place / "none.trc"), "-o", str(place / "new.usda")]
    plain = run_usdface(*given)
    assert plain.returncode == 1
    assert plain.stderr.startswith(b"usdface: ") and plain.stderr.count(b"\n") == 1
    debug = run_usdface(*given, "--debug")
    assert debug.returncode == 1
    assert b"Traceback" in debug.stderr and b"none.trc" in debug.stderr
