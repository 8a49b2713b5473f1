//! Tone mapping for display.

/// Exposed radiance above which highlights are compressed. Chosen.
const KNEE: f64 = 0.8;
/// Excess of radiance over [`KNEE`] that is shown halfway between the knee and 1. Chosen.
const SHOULDER: f64 = 0.6;

/// Maps linear radiance, brightened by `2^stops`, to [0, 1] for [`super::srgb_encode`].
///
/// Colours whose largest channel is at most 0.8 are kept. Brighter ones are compressed towards 1 by one factor for all
/// channels, which keeps their hue. Negative components become 0.
///
/// ```
/// use sunbeam::colour::tone_map;
///
/// assert_eq!(tone_map([0.1, 0.2, 0.4], 1.0), [0.2, 0.4, 0.8]);
/// assert!(tone_map([100.0, 50.0, 0.0], 0.0)[0] < 1.0);
/// ```
pub fn tone_map(linear: [f64; 3], stops: f64) -> [f64; 3] {
    let exposed = linear.map(|value| (value * stops.exp2()).max(0.0));
    let peak = exposed[0].max(exposed[1]).max(exposed[2]);
    let excess = peak - KNEE;
    if !(excess > 0.0 && peak.is_finite()) {
        return exposed;
    }
    let factor = (KNEE + (1.0 - KNEE) * excess / (excess + SHOULDER)) / peak;
    exposed.map(|value| value * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn highlights_keep_their_hue_and_stay_below_one() {
        assert_eq!(tone_map([0.1, 0.2, -0.1], 1.0), [0.2, 0.4, 0.0]);
        let [r, g, b] = tone_map([1.4, 0.7, 0.0], 0.0);
        // 0.6 above the knee is halfway.
        assert!((r - 0.9).abs() < 1e-15 && (g - 0.45).abs() < 1e-15 && b == 0.0);
        assert!(tone_map([1e30; 3], 0.0).iter().all(|value| *value <= 1.0));
        assert!(tone_map([f64::NAN, 0.5, 0.5], 0.0).iter().all(|value| value.is_finite()));
    }
}
