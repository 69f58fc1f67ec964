from usdface.cleanup.repairs import Repair, repair_findings


def test_there_is_one_finding_for_each_marker_and_kind() -> None:
    repairs = [
        Repair("chin", 3, 5, "spike"),
        Repair("chin", 9, 9, "spike"),
        Repair("chin", 3, 5, "fill"),
        Repair("nose", 7, 7, "swap"),
    ]
    findings = repair_findings(repairs)
    assert [(f.code, f.where) for f in findings] == [
        ("MARKER_SPIKE", "chin"),
        ("MARKER_FILLED", "chin"),
        ("MARKER_SWAPPED", "nose"),
    ]
    assert "4 frames in 2 places, the first of them frame 3" in findings[0].message
    assert "frames 3 to 5" in findings[1].message
    assert repair_findings([]) == []


def test_the_marker_with_most_frames_is_the_first_of_its_kind() -> None:
    """The report prints one line of a kind: that of half a take and not that of a few frames."""
    repairs = [Repair("lip", 3, 5, "fill"), Repair("chin", 40, 90, "fill")]
    assert [found.where for found in repair_findings(repairs)] == ["chin", "lip"]
