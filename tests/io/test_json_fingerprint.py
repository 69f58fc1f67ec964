"""An edit of a JSON file shows, another layout of it does not."""

import json

from usdface.io.json_fingerprint import FINGERPRINT, is_unedited, sign

DOCUMENT = {"markers": {"chin": {"point": 7, "confidence": 0.5}}, "peaks": (51, 204), "head": "ä"}


def test_it_holds_over_layout_and_order_and_a_second_time() -> None:
    signed = sign(DOCUMENT)
    assert list(signed) == [*DOCUMENT, FINGERPRINT]
    assert sign(signed) == signed
    for text in (json.dumps(signed), json.dumps(signed, indent=3, sort_keys=True)):
        assert is_unedited(json.loads(text))


def test_every_edit_shows() -> None:
    signed = json.loads(json.dumps(sign(DOCUMENT)))
    moved = signed | {"markers": {"chin": {"point": 8, "confidence": 0.5}}}
    for edited in (moved, signed | {"head": "a"}, signed | {"new": 1}, signed | {"peaks": [51]}):
        assert not is_unedited(edited)
    assert not is_unedited({key: value for key, value in signed.items() if key != "peaks"})
    assert not is_unedited(DOCUMENT)
