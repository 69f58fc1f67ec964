import struct
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile

import pytest
from pxr import Sdf

from usdface.errors import OutputError
from usdface.io.usd import usdz_package
from usdface.io.usd.usdz_package import write_package

FILES = {
    "face.usdc": bytes(range(200)),
    **{f"{size}/{'n' * size}ü.png": bytes(size) for size in range(70)},
}


def test_data_are_stored_as_they_are_and_aligned(tmp_path: Path) -> None:
    path = tmp_path / "a.usdz"
    write_package(path, FILES)
    whole = path.read_bytes()
    with ZipFile(path) as package:
        assert package.namelist() == list(FILES)
        for info in package.infolist():
            assert info.compress_type == ZIP_STORED and info.date_time[0] == 1980
            sizes = struct.unpack_from("<HH", whole, info.header_offset + 26)
            start = info.header_offset + 30 + sum(sizes)
            assert start % 64 == 0
            assert whole[start : start + info.file_size] == FILES[info.filename]
    if hasattr(Sdf, "ZipFile"):  # USD's own reader, from 25.08 on
        assert list(Sdf.ZipFile.Open(str(path)).GetFileNames()) == list(FILES)


def test_a_disk_that_loses_bytes_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Lossy(ZipFile):
        def close(self) -> None:
            file = self.fp
            super().close()
            if file and self.mode == "w":
                file.flush()
                (tmp_path / "a.usdz").write_bytes(whole[:64] + b"x" + whole[65:])

    write_package(tmp_path / "a.usdz", FILES)
    whole = (tmp_path / "a.usdz").read_bytes()
    monkeypatch.setattr(usdz_package.zipfile, "ZipFile", Lossy)
    with pytest.raises(OutputError, match="differs from the written data"):
        write_package(tmp_path / "a.usdz", FILES)


def test_more_than_a_package_can_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(usdz_package.zipfile, "ZIP64_LIMIT", 1000)
    with pytest.raises(OutputError, match="larger than 2 GiB"):
        write_package(tmp_path / "a.usdz", FILES)
