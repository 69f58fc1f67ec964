import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from usdface.errors import InputError, OutputError
from usdface.io.images.encode import encode_image

NOISE = np.random.default_rng(0).integers(0, 256, (64, 48, 3), np.uint8)


def test_an_image_is_the_bytes_of_its_file(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(encode_image(NOISE, ".png", {}))
    assert np.array_equal(oiio.ImageInput.open(str(tmp_path / "a.png")).read_image("uint8"), NOISE)
    coarse, fine = (encode_image(NOISE, ".jpg", {"Compression": f"jpeg:{q}"}) for q in (20, 90))
    assert len(coarse) < len(fine)


def test_an_image_that_a_format_does_not_hold_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be written as PNG"):
        encode_image(np.zeros((2, 2, 9), np.uint8), ".png", {})


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file of this process grows beyond 4 kB, as on a full disk; Python ignores SIGXFSZ."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_an_image_is_whole_or_refused(small_files: None, suffix: str) -> None:
    with pytest.raises(OutputError, match=r"temporary files to .*TMPDIR"):
        encode_image(NOISE, suffix, {})
