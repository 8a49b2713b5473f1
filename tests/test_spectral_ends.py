"""An `eta` or `k` given for a part of the spectrum is extended with the values at its ends, with a warning.

Tests compare with a spectrum given from 360 to 830 nm. Mitsuba's own spectra are zero beyond their ends, and an index
of zero would reflect everything.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction
from conftest import built, use_variant
from surfaces import QUICK

IN, OUT = direction(40, 20), direction(20, 200)
# Wavelengths inside and outside of the given range.
WAVELENGTHS = ([365, 440, 455, 520], [640, 645, 655, 825])
SHORT = [(450, 1.4), (550, 1.5), (650, 1.7)]
WHOLE = [(360, 1.4), *SHORT, (830, 1.7)]
SHORT_K = [(440, 0.8), (660, 0.5)]
WHOLE_K = [(360, 0.8), *SHORT_K, (830, 0.5)]
# Relative difference of interpolation in single precision between equal nodes, from 450 or from 360 nm.
RTOL = 1e-5


def spectrum(samples):
    return {"type": "spectrum", "value": samples}


def regular(samples):
    low, high = samples[0][0], samples[-1][0]
    values = ", ".join(str(value) for _, value in samples)
    return {"type": "regular", "wavelength_min": float(low), "wavelength_max": float(high), "values": values}


def irregular(samples):
    columns = (", ".join(str(number) for number in column) for column in zip(*samples))
    return {"type": "irregular", **dict(zip(("wavelengths", "values"), columns))}


def evaluated(bsdf):
    """Values of `eval` at all WAVELENGTHS, or of colours."""
    found = []
    for wavelengths in WAVELENGTHS:
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = mi.Vector3f(IN)
        si.uv = mi.Point2f(0.3, 0.3)
        if mi.is_spectral:
            si.wavelengths = wavelengths
        found.append(np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(OUT))).ravel())
    return np.concatenate(found)


def made(**parameters):
    return mi.load_dict({"type": "diffraction", **QUICK, **parameters})


def warnings(capfd):
    """Mitsuba's warnings about spectra since the last call."""
    out, err = capfd.readouterr()
    return [line for line in (out + err).splitlines() if "values at its ends" in line]


def assert_same(bsdf, whole):
    expected = evaluated(whole)
    assert np.abs(expected).max() > 0
    np.testing.assert_allclose(evaluated(bsdf), expected, rtol=RTOL, atol=RTOL * np.abs(expected).max())


@pytest.mark.parametrize("obliquity", ["stam", "small_slope"])
def test_spectra_extend_in_every_variant(variant, obliquity, capfd):
    optics = {"obliquity": obliquity, "diffuse_reflectance": 0.3}
    whole = made(eta=spectrum(WHOLE), k=spectrum(WHOLE_K), **optics)
    assert warnings(capfd) == []
    short = made(eta=spectrum(SHORT), k=spectrum(SHORT_K), **optics)
    told = warnings(capfd)
    assert len(told) == 2
    assert 'parameter "eta" is given from 450 to 650 nm only' in told[0]
    assert 'parameter "k" is given from 440 to 660 nm only' in told[1]
    assert all("360 to 830 nm" in line for line in told)
    assert_same(short, whole)
    assert warnings(capfd) == []


@pytest.mark.parametrize("kind", [regular, irregular])
@pytest.mark.parametrize("variant", ["scalar_spectral", "llvm_ad_spectral"])
def test_spectrum_plugins_extend(variant, kind, capfd):
    use_variant(variant)
    whole = made(eta=irregular(WHOLE), k=irregular(WHOLE_K))
    assert warnings(capfd) == []
    short = made(eta=kind(SHORT), k=kind(SHORT_K))
    assert len(warnings(capfd)) == 2
    assert_same(short, whole)


@pytest.mark.parametrize("variant", ["scalar_spectral", "scalar_rgb"])
def test_spectra_of_xml_and_files_extend(variant, tmp_path, capfd):
    use_variant(variant)
    (tmp_path / "eta.spd").write_text("# nm, eta\n" + "".join(f"{nm} {value}\n" for nm, value in SHORT))
    inline = ", ".join(f"{nm}:{value}" for nm, value in SHORT)
    own = "".join(
        f'<string name="{name}" value="{value}"/>'
        if isinstance(value, str)
        else f'<boolean name="{name}" value="false"/>'
        if isinstance(value, bool)
        else f'<float name="{name}" value="{value}"/>'
        for name, value in QUICK.items()
    )
    whole = made(eta=spectrum(WHOLE))
    for given in (f'value="{inline}"', f'filename="{tmp_path / "eta.spd"}"'):
        text = f'<bsdf version="3.0.0" type="diffraction">{own}<spectrum name="eta" {given}/></bsdf>'
        assert_same(mi.load_string(text), whole)
        assert len(warnings(capfd)) == 1


# Mitsuba's data of selenium end at 688.778 nm; those of silver cover the whole range.
@pytest.mark.parametrize("variant", ["scalar_spectral", "llvm_ad_spectral", "scalar_rgb", "llvm_ad_mono"])
def test_materials_known_in_part_extend(variant, capfd):
    use_variant(variant)
    made(material="Ag")
    assert warnings(capfd) == []
    selenium = made(material="Se")
    told = warnings(capfd)
    assert len(told) == 2
    assert 'eta of material "Se" is given from 360 to 688.778 nm' in told[0]
    assert 'k of material "Se"' in told[1]
    parts = {}
    for part in ("eta", "k"):
        rows = mi.spectrum_from_file(str(mi.file_resolver().resolve(f"data/ior/Se.{part}.spd")))
        samples = [(float(nm), float(value)) for nm, value in zip(*rows)]
        parts[part] = spectrum([*samples, (830.0, samples[-1][1])])
    assert_same(selenium, made(**parts))
    assert warnings(capfd) == []


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_colours_use_the_extended_spectrum(variant):
    use_variant(variant)
    short, whole = (mi.traverse(made(eta=spectrum(samples))) for samples in (SHORT, WHOLE))
    np.testing.assert_allclose(np.ravel(short["eta.value"]), np.ravel(whole["eta.value"]), rtol=RTOL)


def test_spectra_in_a_texture_extend_from_their_common_range(capfd):
    use_variant("llvm_ad_spectral")
    other = [(430, 1.4), (550, 1.5), (640, 1.68)]
    board = {"type": "checkerboard", "color0": irregular(SHORT), "color1": irregular(other)}
    bsdf = made(eta=board)
    (told,) = warnings(capfd)
    assert 'parameter "eta" is given from 450 to 640 nm only' in told
    ends = [(360, 1.4), (450, 1.4), (550, 1.5), (640, 1.68), (830, 1.68)]
    # Neither index is near zero, which would reflect everything.
    expected = evaluated(made(eta={**board, "color0": irregular(ends), "color1": irregular(ends)}))
    np.testing.assert_allclose(evaluated(bsdf), expected, rtol=RTOL)


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral"])
def test_a_spectrum_beside_a_textured_part_extends(name, capfd):
    use_variant(name)
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2), 0.7, np.float32)), "raw": True}
    for part, short, whole, textured in (("eta", SHORT, WHOLE, "k"), ("k", SHORT_K, WHOLE_K, "eta")):
        bsdf = made(**{part: spectrum(short), textured: texture})
        (told,) = warnings(capfd)
        assert f'parameter "{part}" is given from {short[0][0]} to {short[-1][0]} nm only' in told
        assert_same(bsdf, made(**{part: spectrum(whole), textured: texture}))
        assert warnings(capfd) == []


def test_reflectances_do_not_extend(capfd):
    """A reflectance stays zero beyond its ends."""
    use_variant("llvm_ad_spectral")
    bsdf = made(eta=1.5, specular_reflectance=spectrum([(450, 1.0), (650, 1.0)]), diffuse_reflectance=0.0)
    assert warnings(capfd) == []
    dark = np.isin(np.concatenate(WAVELENGTHS), [365, 440, 655, 825])
    assert np.array_equal(evaluated(bsdf) == 0, dark)


@pytest.mark.parametrize("variant", ["scalar_spectral", "llvm_ad_spectral"])
def test_changed_ranges_extend_from_their_new_ends(variant, capfd):
    use_variant(variant)
    bsdf = made(eta=irregular(WHOLE))
    assert warnings(capfd) == []
    parameters = mi.traverse(bsdf)
    for low, high in ((450, 650), (470, 600)):
        parameters["eta.wavelengths"] = [low, 500, 550, 580, high]
        parameters.update()
        (told,) = warnings(capfd)
        assert f"from {low} to {high} nm" in told
        ends = [(360, 1.4), (low, 1.4), (500, 1.4), (550, 1.5), (580, 1.7), (high, 1.7), (830, 1.7)]
        assert_same(bsdf, made(eta=irregular(ends)))
        capfd.readouterr()
    # Changed values at unchanged wavelengths give no warning.
    parameters["eta.values"] = [1.3, 1.4, 1.5, 1.6, 1.7]
    parameters.update()
    assert warnings(capfd) == []


def test_a_frozen_function_follows_the_range():
    use_variant("llvm_ad_spectral")
    bsdf = made(eta=irregular(SHORT))
    parameters = mi.traverse(bsdf)

    @dr.freeze
    def frozen(bsdf, si, wo):
        return bsdf.eval(mi.BSDFContext(), si, wo)

    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.wi = mi.Vector3f(IN)
    si.wavelengths = [[365, 440], [455, 520], [620, 645], [655, 825]]
    wo = mi.Vector3f(OUT) + dr.zeros(mi.Float, 2)
    # Ranges become narrower: Mitsuba's own spectra are zero beyond the range at the recording.
    for low, high in ((450, 650), (470, 630), (500, 600)):
        parameters["eta.wavelengths"] = [low, 550, high]
        parameters.update()
        expected = np.array(bsdf.eval(mi.BSDFContext(), si, wo))
        np.testing.assert_allclose(np.array(frozen(bsdf, si, wo)), expected, rtol=RTOL)


@pytest.mark.parametrize("variant", ["scalar_spectral", "scalar_rgb"])
def test_a_spectrum_beyond_all_wavelengths_is_refused(variant):
    use_variant(variant)
    with pytest.raises(RuntimeError, match='parameter "k": no wavelength from 360 to 830 nm has a value'):
        made(eta=1.5, k=spectrum([(900, 0.1), (1200, 0.2)]))


def test_rigorous_tables_use_extended_spectra(scalar_rgb, capfd):
    grating = {"preset": "sinusoidal", "period": 0.3, "height": 0.02, "theory": "rigorous", "coherence_length": 4.0}
    whole = built("scalar_rgb", **grating, eta=spectrum(WHOLE), diffuse_reflectance=0.3)
    assert warnings(capfd) == []
    short = built("scalar_rgb", **grating, eta=spectrum(SHORT), diffuse_reflectance=0.3)
    assert len(warnings(capfd)) == 1
    assert_same(short, whole)
