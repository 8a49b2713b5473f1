"""Diffraction colours of measured nanostructures for Mitsuba 3 and NumPy.

Importing the package makes ``{"type": "diffraction"}`` available in Mitsuba, in the current variant and in those set
later::

    import mitsuba as mi
    import sunbeam_mitsuba

    mi.set_variant("llvm_ad_spectral")
    skin = mi.load_dict({"type": "diffraction", "preset": "xenopeltis", "eta": 1.56})

:class:`Surface` evaluates and samples the same BSDF from NumPy, without a scene::

    surface = sunbeam_mitsuba.Surface(preset="blazed", coherence_length=30)
    f = surface.eval(wi=[0, 0, 1], wo=[[0.28, 0, 0.96], [0.6, 0, 0.8]], wavelength_nm=[450, 550, 650])  # shape (2, 3)

``eta`` is the refractive index, and lengths are in µm. Directions are unit vectors away from the surface; z is its
normal.
"""

from ._errors import SunbeamError
from ._plugin import MITSUBA_VERSION, PLUGIN_FOLDER, register
from ._surface import Surface

__all__ = ["MITSUBA_VERSION", "PLUGIN_FOLDER", "SunbeamError", "Surface", "register"]
__version__ = "0.1.0"

register()
