import gc
import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from usdface.blas_threads import limit_from_start

limit_from_start()  # before numpy is loaded, which the next imports do

from documented_findings import undocumented  # noqa: E402

from usdface.advice import RAISING  # noqa: E402
from usdface.cli import main  # noqa: E402
from usdface.findings import Finding  # noqa: E402

# Short tests make no garbage that is worth the search for it at each 700th object: an eighth of the
# time goes there.
gc.set_threshold(50_000, 20, 50)

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session", autouse=True)
def advice_fails_aloud() -> Iterator[None]:
    """A mistake in what only advises is no finding here."""
    token = RAISING.set(True)
    yield
    RAISING.reset(token)


@pytest.fixture(scope="session", autouse=True)
def values_of_findings_are_documented() -> Iterator[None]:
    """Every finding that a test makes has the keys of its code in docs/reports.md."""
    prepare = Finding.__post_init__

    def checked(found: Finding) -> None:
        prepare(found)
        lacking = undocumented(found.code, dict(found.values))
        assert not lacking, "\n".join(lacking)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Finding, "__post_init__", checked)
        yield


@pytest.fixture(scope="session", autouse=True)
def no_power_failure() -> Iterator[None]:
    """Files wait for no disk here, which takes milliseconds each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.fsync", lambda descriptor: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def trusted_files() -> Iterator[None]:
    """USD files are opened at once: most are our own, and a process for each takes 0.2 s."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("USDFACE_TRUSTED", "1")
        yield


@pytest.fixture
def as_users_have_it() -> Iterator[None]:
    """Advice that fails is a finding after all."""
    token = RAISING.set(False)
    yield
    RAISING.reset(token)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real data beside the project; a user's clone does not have it."""
    if not SHARED.is_dir():
        pytest.skip("real data (../shared/data) is not beside this clone")
    return SHARED


@pytest.fixture(scope="session")
def ict_rig(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The ICT face as `usdface rig` makes it of a folder of meshes, for reading only."""
    from ict_face import write_meshes

    folder = tmp_path_factory.mktemp("ict_face")
    write_meshes(shared_data, folder / "face")
    assert main(["rig", str(folder / "face"), "-o", str(folder / "rig.usdc")]) == 0
    return folder / "rig.usdc"


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The world's shot, processed, for reading only: a `processed.Done`."""
    from processed import processed_world

    return processed_world(tmp_path_factory.mktemp("done"))


@pytest.fixture(scope="session")
def assert_valid_usd() -> Callable[[Path], None]:
    """A function that fails with USD's own words when its validators find an error."""
    from pxr import Usd, UsdValidation
    from usd_validators import all_validators

    def check(path: Path) -> None:
        context = UsdValidation.ValidationContext(all_validators())
        errors = context.Validate(Usd.Stage.Open(str(path)))
        assert [f"{e.GetName()}: {e.GetMessage()}" for e in errors] == []

    return check


@pytest.fixture(scope="session")
def validate_gltf() -> Iterator[Callable[[Path], dict[str, Any]]]:
    """A function from a glTF file to the report of the Khronos validator, which runs once."""
    root = Path(__file__).resolve().parents[1]
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    if not (root / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("gltf-validator is missing: npm install --no-save gltf-validator")
    command = [node, str(root / "tests" / "gltf_validate.mjs")]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, cwd=root, text=True) as validator:
        asked, answered = validator.stdin, validator.stdout
        assert asked and answered

        def validate(path: Path) -> dict[str, Any]:
            asked.write(f"{path.absolute()}\n")
            asked.flush()
            report = json.loads(answered.readline())
            assert "failure" not in report, report
            return report

        yield validate
