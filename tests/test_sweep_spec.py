"""Specifications of sweeps: accepted and refused ones, and combinations of values."""

from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
from sweeps import REPOSITORY, SPEC


def read(sweep_package, folder, text):
    path = folder / "spec.toml"
    path.write_text(text)
    return sweep_package.read_spec(path)


def with_surface(lines, settings="", want="[want.colour]"):
    return f'output = "out"\n[[surface]]\n{lines}\n[settings]\n{settings}\n{want}\n'


def parameters(sweep_package, folder, *arguments):
    return [case.parameters for case in read(sweep_package, folder, with_surface(*arguments)).cases("1")]


def test_a_product_has_all_combinations_in_order(sweep_package, tmp_path):
    found = parameters(sweep_package, tmp_path, 'preset = "blazed"\nheight = [0.1, 0.2]', "theta_i_deg = [0, 30, 60]")
    assert [(one["height"], one["theta_i_deg"]) for one in found] == [
        (0.1, 0), (0.1, 30), (0.1, 60), (0.2, 0), (0.2, 30), (0.2, 60),
    ]  # fmt: skip
    assert all(one["preset"] == "blazed" and one["phi_i_deg"] == 0 for one in found)


def test_a_list_goes_through_its_values_together(sweep_package, tmp_path):
    settings = 'combine = "list"\ntheta_i_deg = [0, 30]\ncoherence_length = [5, 10]\neta = 1.5'
    found = parameters(sweep_package, tmp_path, 'preset = "flat"', settings)
    assert [(one["theta_i_deg"], one["coherence_length"], one["eta"]) for one in found] == [(0, 5, 1.5), (30, 10, 1.5)]


def test_a_sample_is_the_same_for_its_seed(sweep_package, tmp_path):
    def drawn(seed):
        settings = (
            f'combine = "sample"\ncount = 200\nseed = {seed}\ntheta_i_deg = {{ from = 10, to = 70 }}\n'
            'coherence_length = { from = 1, to = 100, scale = "log" }\nmodel = ["ensemble", "patch"]'
        )
        return parameters(sweep_package, tmp_path, 'preset = "flat"', settings)

    first = drawn(3)
    assert first == drawn(3)
    assert first != drawn(4)
    assert len(first) == 200
    assert all(10 <= one["theta_i_deg"] < 70 and 1 <= one["coherence_length"] < 100 for one in first)
    # Uniform in the logarithm: half of the values are below 10.
    assert 70 < sum(one["coherence_length"] < 10 for one in first) < 130
    assert 70 < sum(one["model"] == "patch" for one in first) < 130
    # The number of Python's generator for this seed, equal in all versions.
    assert first[0]["coherence_length"] == pytest.approx(2.9925, abs=1e-3)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("{ from = 0, to = 0.3, count = 4 }", [0, 0.1, 0.2, 0.3]),
        ("{ from = 0, to = 0.3, step = 0.1 }", [0, 0.1, 0.2, 0.3]),
        ("{ from = 0, to = 0.35, step = 0.1 }", [0, 0.1, 0.2, 0.3]),
        ('{ from = 0.01, to = 1, count = 3, scale = "log" }', [0.01, 0.1, 1]),
        ("0.5", [0.5]),
    ],
)
def test_ranges_have_round_numbers(sweep_package, tmp_path, given, expected):
    assert [
        one["k"] for one in parameters(sweep_package, tmp_path, 'preset = "flat"', f"eta = 1\nk = {given}")
    ] == expected


def test_globs_are_sorted_and_relative(sweep_package, tmp_path):
    (tmp_path / "scans").mkdir()
    for name in ("b.txt", "a.txt", "c.npy"):
        (tmp_path / "scans" / name).write_text("0 0\n0 0\n")
    found = parameters(sweep_package, tmp_path, 'files = ["scans/*.txt", "scans/?.npy"]\npixel_size = 0.1')
    assert [one["filename"] for one in found] == ["scans/a.txt", "scans/b.txt", "scans/c.npy"]


def test_equal_cases_are_merged(sweep_package, tmp_path):
    spec = read(sweep_package, tmp_path, with_surface('preset = ["flat", "flat"]', "theta_i_deg = [0, 0.0, 10]"))
    assert spec.count == 6
    assert [case.parameters["theta_i_deg"] for case in spec.cases("1")] == [0, 10]


def test_an_identity_depends_on_every_input(sweep_package, tmp_path):
    def identity(version="1", settings="eta = 1.5", want="[want.colour]"):
        (case,) = read(sweep_package, tmp_path, with_surface('preset = "flat"', settings, want)).cases(version)
        return case.identity

    assert identity() == identity()
    others = [identity("2"), identity(settings="eta = 1.6"), identity(want="[want.colour]\nsamples = 99")]
    assert len({identity(), *others}) == 4


REFUSED = [
    ("", "at least one [[surface]]"),
    ("output = 3", "at least one [[surface]]"),
    ('outputs = "x"', "unknown key 'outputs'; accepted are output, surface, settings, want"),
    (with_surface('preset = "cobra"'), "preset is 'cobra', but must be one of blazed"),
    (with_surface('presett = "flat"'), "surface 1: unknown key 'presett'"),
    (with_surface("period = 2"), "give one of preset, filename and files"),
    (with_surface('preset = "flat"\nfilename = "a.gsf"'), "give one of preset, filename and files"),
    (with_surface('files = "none/*.gsf"'), "no file matches 'none/*.gsf'"),
    (with_surface("files = []"), "must be a glob or a list of globs"),
    (with_surface('preset = "blazed"\nperiod = { from = -1, to = 2, count = 3 }'), "period is -1, but must be"),
    (with_surface('preset = "blazed"\nperiod = { from = 1, to = 2e3, count = 3 }'), "period is 2000"),
    (with_surface('preset = "blazed"\nperiod = { from = 1, to = 2 }'), "needs one of count and step"),
    (with_surface('preset = "blazed"\nperiod = { to = 2, count = 2 }'), "a range needs from and to"),
    (with_surface('preset = "blazed"\nperiod = { from = 1, to = 2, count = 1 }'), "whole number from 2"),
    (with_surface('preset = "blazed"\nperiod = { from = 2, to = 1, step = 1 }'), "must rise"),
    (with_surface('preset = "blazed"\nperiod = { from = 1, to = 2, steps = 2 }'), "unknown key 'steps'"),
    (with_surface('preset = "blazed"\nperiod = []'), "empty list"),
    (with_surface('preset = "blazed"\nperiod = true'), "period is True"),
    (with_surface('preset = "blazed"\nperiod = nan'), "period is nan"),
    (with_surface('preset = "flat"\nlevel = { from = 0, to = 1, count = 2 }'), "is a range, but must be one of none"),
    (with_surface('preset = "flat"', "theta_i_deg = 90"), "theta_i_deg is 90, but must be a number in degrees"),
    (with_surface('preset = "flat"', "theta = 9"), "settings: unknown key 'theta'"),
    (with_surface('preset = "flat"', "count = 9"), 'count needs combine = "sample"'),
    (with_surface('preset = "flat"', 'combine = "sample"\neta = 2'), "count is None"),
    (with_surface('preset = "flat"', 'combine = "all"'), "combine is 'all', but must be one of product, list, sample"),
    (with_surface('preset = "flat"', 'combine = "list"\neta = [1, 2]\nk = [1, 2, 3]'), "eta has 2 values"),
    (with_surface('preset = "flat"\neta = 1.5', "eta = 1.6"), "eta is given here and in settings"),
    (with_surface('preset = "flat"', "eta = { from = 1, to = 2, count = 2000 }\nk = { from = 1, to = 2, step = 5e-4 }"),
     "4002000 cases; accepted are at most 1000000"),
    (with_surface('preset = "flat"', "", ""), "at least one [want.NAME]; there are statistics, peaks"),
    (with_surface('preset = "flat"', "", "[want.color]"), "want: unknown key 'color'"),
    (with_surface('preset = "flat"', "", "[want.map]\nsize = 3"), "size is 3, but must be a whole number"),
    (with_surface('preset = "flat"', "", '[want.colour]\nilluminant = "F2"'), "must be one of D65, E, A"),
    (with_surface('preset = "flat"', "", "[want.orders]\nwavelengths_nm = [300]"), "in [380, 780]"),
    (with_surface('preset = "flat"', "", "[want.render]"), "needs scene"),
    (with_surface('preset = "flat"', "", '[want.render]\nscene = "none.xml"'), "scene none.xml cannot be read"),
    (with_surface('preset = "flat"', "phi_i_deg = 10", "[want.peaks]"), "phi_i_deg is 10, but peaks are along x"),
    (with_surface('preset = "flat"', 'material = "Al"', "[want.orders]"), "material is not known to it"),
    ("output = ", "is not TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "mentioned"), REFUSED, ids=[mentioned[:40] for _, mentioned in REFUSED])
def test_refusals_are_one_line(sweep_package, tmp_path, text, mentioned):
    with pytest.raises(sweep_package.SweepError) as error:
        read(sweep_package, tmp_path, text)
    assert mentioned in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(sweep_package, tmp_path):
    with pytest.raises(sweep_package.SweepError, match=r"none\.toml cannot be read"):
        sweep_package.read_spec(tmp_path / "none.toml")


def refusal(package, **given):
    with pytest.raises(package.SunbeamError) as error:
        package.Surface(**given)
    return str(error.value)


def test_limits_equal_the_librarys(sweep_package):
    """The library refuses values outside of the limits by name, and accepts the ends."""
    import sunbeam_mitsuba
    from sunbeam_mitsuba.sweep.limits import SOURCE, SURFACE, NumberOrText, Numbers, Text, Truth, Words

    regions = {"preset": "elaphe", "region_size": 10.0, "region_spread": 0.01}
    bases = {"period": {"preset": "blazed"}, "height": {"preset": "blazed"}, "region_size": regions}
    bases.update(region_spread=regions, k={"filename": "none.gsf", "eta": 1.5})
    bases.update(transmission=bases["k"])

    def names_it(name, value):
        # An accepted value leads to the next error: a missing file, or the contradiction of preset and max_height.
        base = bases.get(name, {"filename": "none.gsf"})
        given = {**base, name: value, **({"max_height": 1.0} if "preset" in base else {})}
        return f'parameter "{name}"' in refusal(sunbeam_mitsuba, **given)

    checked = 0
    for name, accepted in {**SOURCE, **SURFACE}.items():
        if isinstance(accepted, Numbers):
            step = 1e-6 * max(abs(accepted.low), 1e-3)
            inside = [accepted.low + (step if accepted.open_low else 0), accepted.high]
            outside = [accepted.low - (0 if accepted.open_low else step), accepted.high * (1 + 1e-6)]
        elif isinstance(accepted, Words):
            inside, outside = list(accepted.words), ["none of these"]
            if name == "preset":
                assert "none of these" in refusal(sunbeam_mitsuba, preset="none of these")
                message = refusal(sunbeam_mitsuba, preset="none of these")
                assert all(word in message for word in accepted.words)
                continue
        elif isinstance(accepted, Truth):
            inside, outside = [True, False], ["yes"]
        else:
            assert isinstance(accepted, (Text, NumberOrText))
            continue
        for value in inside:
            assert not names_it(name, value), (name, value)
        for value in outside:
            assert names_it(name, value), (name, value)
            checked += 1
    assert checked > 25


def test_media_and_channels_may_be_numbers_or_names(sweep_package):
    from sunbeam_mitsuba.sweep.limits import BSDF_ONLY, SURFACE

    for accepted, values in ((BSDF_ONLY["int_ior"], (1.5, "bk7")), (SURFACE["channel"], (0, 2, "Height"))):
        assert all(accepted.accepts(value) for value in values)
        assert not any(accepted.accepts(value) for value in (-1, "", True, float("nan")))
    assert not SURFACE["channel"].accepts(0.5)
    assert str(SURFACE["channel"]) == "a whole number in [0, 1000] or a text"


def test_parameters_equal_the_plugins(sweep_package):
    import re

    from sunbeam_mitsuba.sweep.limits import BSDF_ONLY, SOURCE, SURFACE

    rows = re.findall(
        r"^\| ((?:`[a-z_]+`(?:, )?)+) \|", Path(REPOSITORY / "docs" / "plugin.md").read_text("utf-8"), re.M
    )
    assert {name for row in rows for name in re.findall(r"`([a-z_]+)`", row)} == {*SOURCE, *SURFACE, *BSDF_ONLY}


def test_workers_follow_from_memory(sweep_package):
    from sunbeam_mitsuba.sweep.cluster import plan_workers
    from sunbeam_mitsuba.sweep.errors import SweepError

    assert plan_workers(3, 2e9, 0, 100) == (3, 2e9)
    assert plan_workers(None, None, 0, 1)[0] == 1
    workers, memory = plan_workers(None, None, 1e15, 100)
    assert workers == 1
    assert memory > 0
    for number, size in ((0, None), (None, 0.0), (None, float("nan"))):
        with pytest.raises(SweepError, match="must be a finite number above zero"):
            plan_workers(number, size, 0, 100)


def test_an_estimate_is_told_of_transmission(sweep_package, monkeypatch):
    from sunbeam_mitsuba.sweep import command

    asked = []
    monkeypatch.setattr(command, "ask", lambda *words: asked.append(words) or {"table_bytes_estimate": 7})
    for given, words in (
        ({"eta": 1.7, "k": 0.0}, ()),
        ({"eta": 1.7, "transmission": "film"}, ("--transmission=film", "--eta=1.7")),
        ({"int_ior": 2.0, "transmission": "interface"}, ("--transmission=interface", "--eta=2.0")),
        ({"int_ior": "bk7", "transmission": "film"}, ("--transmission=film", "--eta=1.5046")),
    ):
        command._described.cache_clear()
        assert command.table_bytes({"preset": "elaphe", **given}) == 7
        assert asked.pop() == ("height-field", "--preset=elaphe", *words)
    command._described.cache_clear()


class OneGigabyte:
    """A fake surface with tables of 1 GB."""

    table_bytes = 1e9


def test_surfaces_are_dropped_where_memory_is_short(sweep_package, monkeypatch):
    from sunbeam_mitsuba.sweep import tables

    built = []
    monkeypatch.setattr(tables, "make_reflector", lambda parameters: built.append(parameters["eta"]) or OneGigabyte())
    held = tables.HeldSurfaces(2 * 2.5e9 + tables.WORKER_BYTES)
    for eta in (1, 2, 1, 3, 1, 2):
        held.get({"preset": "flat", "eta": eta, "theta_i_deg": 10 * eta})
    # Two surfaces fit: 3 replaces 2, which was used before 1.
    assert built == [1, 2, 3, 2]
    assert len(held) == 2
    monkeypatch.setattr(tables, "estimated_peak_bytes", lambda parameters: 7e9)
    with pytest.raises(tables.TooLarge, match=r"about 7\.0 GB, and the worker has 5\.0 GB"):
        held.get({"preset": "flat", "eta": 9})
    # A refused build drops nothing.
    assert len(held) == 2


def test_surfaces_are_dropped_for_the_peak_of_a_build(sweep_package, monkeypatch):
    from sunbeam_mitsuba.sweep import tables

    held = tables.HeldSurfaces(5e9 + tables.WORKER_BYTES)
    held_at_builds = []
    monkeypatch.setattr(tables, "make_reflector", lambda parameters: held_at_builds.append(len(held)) or OneGigabyte())
    monkeypatch.setattr(tables, "estimated_peak_bytes", lambda parameters: parameters["scale"] * 1e9)
    # Numbers of held surfaces that fit beside peaks of 1, 3 and 4.5 GB: any, two, none.
    for peak_gb in (1, 3, 4.5):
        held.get({"preset": "flat", "scale": peak_gb})
    assert held_at_builds == [0, 1, 0]


def test_surfaces_of_unknown_size_count_by_their_estimate(sweep_package, monkeypatch):
    from sunbeam_mitsuba.sweep import tables

    class Unknown:
        table_bytes = 0.0

    monkeypatch.setattr(tables, "make_reflector", lambda parameters: Unknown())
    monkeypatch.setattr(tables, "estimated_peak_bytes", lambda parameters: 6e9)
    # By the ratio of peak and table each surface takes 1 GB, and half of 8 GB is for held surfaces.
    monkeypatch.setattr(tables, "_PEAK_OVER_TABLE", 6.0)
    held = tables.HeldSurfaces(8e9 + tables.WORKER_BYTES)
    for eta in range(1, 9):
        held.get({"preset": "flat", "eta": eta})
    # Two stay beside the next build of 6 GB, which makes three.
    assert len(held) == 3


def test_the_expected_period_of_peaks_follows_the_scale(sweep_package):
    from sunbeam_mitsuba.sweep.wants.peaks import Peaks

    peaks = Peaks((550.0,), 0.02, None)
    assert peaks._period_um({"preset": "blazed", "scale": 0.5}) == 1.25
    assert peaks._period_um({"preset": "blazed", "period": 2.0, "scale": 0.5}) == 1.0


def test_a_render_gives_the_index_as_a_float(sweep_package, tmp_path):
    from sunbeam_mitsuba.sweep.wants.render import Render

    (tmp_path / "scene.xml").write_text('<scene version="3.0.0"><bsdf type="diffuse" id="surface"/></scene>')
    parameters = {"preset": "flat", "transmission": "interface", "eta": 1.5, "theta_i_deg": 0.0}
    text = Render.read({"scene": "scene.xml"}, tmp_path)._scene_with(SimpleNamespace(parameters=parameters))
    # A spectrum would be refused where light is transmitted.
    assert '<float name="eta" value="1.5" />' in text


def test_the_shared_specification_has_twelve_cases(sweep_package, tmp_path):
    assert len(list(read(sweep_package, tmp_path, SPEC).cases("1"))) == 12


def test_media_of_a_case_replace_the_scene_s_index(sweep_package, tmp_path):
    bsdf = '<bsdf type="diffraction" id="surface"><float name="eta" value="1.5"/></bsdf>'
    (tmp_path / "scene.xml").write_text(f'<scene version="3.0.0">{bsdf}</scene>')
    want = '[want.render]\nscene = "scene.xml"'
    media = 'transmission = "interface"\nint_ior = 2\next_ior = "vacuum"'
    spec = read(sweep_package, tmp_path, with_surface('preset = "flat"', media, want))
    (case,) = spec.cases("1")
    scene = ElementTree.fromstring(spec.wants[0]._scene_with(case))
    found = {(element.tag, element.get("name"), element.get("value")) for element in scene.find("bsdf")}
    assert {("integer", "int_ior", "2"), ("string", "ext_ior", "vacuum")} < found
    assert "eta" not in {name for _, name, _ in found}
