import pytest

from usdface.cli.progress import progress
from usdface.progress import COMPILE, Step


@pytest.mark.parametrize("shown", [True, False])
def test_elsewhere_than_on_terminals_only_a_long_wait_is_named(
    shown: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress(shown) as on_progress:
        on_progress(Step("solve"))
        assert capsys.readouterr() == ("", "")
        on_progress(Step(COMPILE))
    assert capsys.readouterr() == ("", "usdface: compile the solver (once) ...\n")


def test_progress_on_a_terminal_shows_the_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress(True) as on_progress:
        on_progress(Step("read"))
        on_progress(Step("solve", 0.5))
    said = capsys.readouterr()
    assert said.out == "" and "solve" in said.err
