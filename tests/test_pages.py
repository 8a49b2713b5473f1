"""What all pages of figures share."""

from docs.figures.page import named, scans_first


def test_skins_that_were_not_measured_are_said_to_be_procedural():
    assert named("elaphe") == "elaphe (procedural)"
    assert named("diffraction xenopeltis, bare") == "diffraction xenopeltis (procedural), bare"
    for measured in ("scan of xenopeltis", "scan-elaphe", "blazed", "cd"):
        assert named(measured) == measured


def test_scans_come_first_and_the_rest_stays_in_order():
    assert scans_first(["cd", "blazed", "scan"]) == ["scan", "cd", "blazed"]
    assert scans_first({"b": 1, "scan of c": 2}.items()) == [("scan of c", 2), ("b", 1)]
    rows = [{"name": name} for name in ("z", "a", "scan")]
    assert [row["name"] for row in scans_first(rows, "name")] == ["scan", "z", "a"]
