"""Kinds of image data, by their first bytes."""

__all__ = ["BY_LINES", "has_alpha", "image_type", "is_cut_off_webp", "is_webp"]

# First bytes: PNG (Third Edition) 5.2; JPEG, ITU-T T.81, B.1.1.3.
_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
# PNG, JPEG, OpenEXR, TIFF: OpenImageIO holds a part of them at a time, of others the whole image.
BY_LINES = (_PNG, _JPEG, b"v/1\x01", b"II*\0", b"MM\0*")


def image_type(data: bytes) -> str:
    """Return the MIME type of PNG or JPEG data by their first bytes, "" for anything else."""
    if data.startswith(_PNG):
        return "image/png"
    return "image/jpeg" if data.startswith(_JPEG) else ""


def is_webp(data: bytes) -> bool:
    """Return whether data are a WebP image, by its first bytes (RFC 9649, section 2.4)."""
    return data[:4] == b"RIFF" and data[8:12] == b"WEBP"


def is_cut_off_webp(data: bytes) -> bool:
    """Return whether a WebP image is shorter than its header states (RFC 9649, section 2.4).

    OpenImageIO 3.0 fills the missing part with black.
    """
    return is_webp(data) and int.from_bytes(data[4:8], "little") + 8 > len(data)


def has_alpha(data: bytes) -> bool:
    """Return whether PNG or JPEG data have an alpha channel (by the PNG's colour type)."""
    return image_type(data) == "image/png" and data[25:26] in (b"\x04", b"\x06")
