import pytest

from usdface.cli.progress import progress
from usdface.progress import Step


def test_progress_is_for_terminals_only(capsys: pytest.CaptureFixture[str]) -> None:
    for shown in (True, False):
        with progress(shown) as on_progress:
            assert on_progress is None
    assert capsys.readouterr() == ("", "")


def test_progress_on_a_terminal_shows_the_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress(True) as on_progress:
        assert on_progress is not None
        on_progress(Step("read"))
        on_progress(Step("solve", 0.5))
    said = capsys.readouterr()
    assert said.out == "" and "solve" in said.err
