//! A surface as evaluated by one of the methods.

use super::surface_args::SurfaceArgs;
use rayon::prelude::*;
use std::error::Error;
use std::str::FromStr;
use sunbeam::reflectance::{ComplexIndex, Exact, Pair, Surface, Vec3, fresnel_unpolarised};
use sunbeam::table::{WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};

/// Largest tile for which direct sums run side by side; those of larger ones are parallel within, and side by side
/// would need a lot of memory.
const SIDE_BY_SIDE_PIXELS: usize = 1 << 16;

/// How the reflectance is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The direct double-precision sum.
    Exact,
    /// The tables.
    Table,
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "exact" => Ok(Self::Exact),
            "table" => Ok(Self::Table),
            "flss" | "nmm" | "pq" | "stam" => Err("not available yet; available: exact, table".to_owned()),
            _ => Err("unknown; available: exact, table".to_owned()),
        }
    }
}

/// A surface and the method that answers for it.
pub struct Reflector {
    surface: Surface,
    exact: Option<Exact>,
    index: Option<ComplexIndex>,
    side_by_side: bool,
}

impl Reflector {
    /// Builds the tables; the exact method needs them too, for the energy scaling and the sampler's density.
    pub fn new(args: &SurfaceArgs, method: Method) -> Result<Self, Box<dyn Error>> {
        let index = args.index()?;
        let config = args.config()?;
        let field = config.height_field()?;
        let options = config.options();
        let surface = Surface::new(&field, &options)?;
        let exact = (method == Method::Exact).then(|| Exact::new(&field, &options, surface.scale().cloned()));
        let (nx, ny) = field.size();
        let side_by_side = exact.is_none() || nx * ny <= SIDE_BY_SIDE_PIXELS;
        Ok(Self { surface, exact, index, side_by_side })
    }

    /// The tables.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// `f_r` in 1/sr, the Fresnel reflectance included.
    pub fn f(&self, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
        let Some(pair) = Pair::new(wi, wo) else { return 0.0 };
        let reflectance = self.index.map_or(1.0, |index| fresnel_unpolarised(pair.cos_half(), index));
        reflectance
            * match &self.exact {
                Some(exact) => exact.eval(wi, wo, wavelength_nm),
                None => self.surface.eval_pdf(wi, wo, wavelength_nm).f,
            }
    }

    /// Refuses wavelengths that the method cannot answer for.
    pub fn check_wavelengths(&self, wavelengths_nm: &[f64]) -> Result<(), String> {
        if wavelengths_nm.is_empty() {
            return Err("\"wavelength\" is an empty array; at least one is needed".to_owned());
        }
        for nm in wavelengths_nm {
            if self.exact.is_some() && !(nm.is_finite() && *nm > 0.0) {
                return Err(format!("\"wavelength\" is {nm} nm; it must be finite and positive"));
            }
            if self.exact.is_none() && !tabulated(*nm) {
                return Err(format!(
                    "\"wavelength\" is {nm} nm; it must be in [{WAVELENGTH_MIN_NM}, {WAVELENGTH_MAX_NM}]"
                ));
            }
        }
        Ok(())
    }

    /// The density of the sampler for the wavelengths carried; `None` where it does not serve one of them.
    pub fn pdf(&self, wi: Vec3, wo: Vec3, wavelengths_nm: &[f64]) -> Option<f64> {
        wavelengths_nm.iter().all(|nm| tabulated(*nm)).then(|| self.surface.pdf(wi, wo, wavelengths_nm))
    }

    /// `answer` of every item in order, computed side by side where that is sensible.
    pub fn map<T: Sync, A: Send>(&self, items: &[T], answer: impl Fn(&T) -> A + Sync + Send) -> Vec<A> {
        if self.side_by_side {
            items.par_iter().with_min_len(8).map(answer).collect()
        } else {
            items.iter().map(answer).collect()
        }
    }
}

fn tabulated(wavelength_nm: f64) -> bool {
    (WAVELENGTH_MIN_NM..=WAVELENGTH_MAX_NM).contains(&wavelength_nm)
}
