import pytest

from usdface.cli.progress import progress


def test_progress_is_for_terminals_only(capsys: pytest.CaptureFixture[str]) -> None:
    for shown in (True, False):
        with progress(shown) as on_step:
            assert on_step is None
    assert capsys.readouterr() == ("", "")


def test_progress_on_a_terminal_shows_the_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress(True) as on_step:
        assert on_step is not None
        on_step("solve")
    said = capsys.readouterr()
    assert said.out == "" and "solve" in said.err
