"""A few dozen shots in one process, of those of `soak.py`."""

from pathlib import Path

import pytest
from attack.soak import soak


@pytest.mark.slow
def test_memory_and_open_files_are_flat(tmp_path: Path) -> None:
    found = soak(tmp_path, 60, every=10)
    (_, memory, held, files), (_, last_memory, last_held, last_files) = found[1], found[-1]
    assert last_files <= files
    assert last_memory - memory < 5  # MB; 40 shots
    assert 1e6 * (last_held - held) < 40 * 3000  # bytes
