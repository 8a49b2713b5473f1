//! Tone mapping for display. `tone.wgsl` of crates/realtime has the same curve for the GPU; a test in
//! crates/window/src/tone.rs compares both.
//!
//! ```text
//! p    largest channel of a colour after exposure, its product with 2^stops
//! e    p − KNEE, its excess over the knee
//! p'   KNEE + (1 − KNEE)·e/(e + SHOULDER) where e > 0, else p: the largest channel that is displayed, below 1
//! ```

/// Largest channel up to which colours are displayed unchanged. Larger values leave less contrast to highlights;
/// smaller ones darken more of the picture.
const KNEE: f64 = 0.8;
/// Excess over [`KNEE`] that is displayed halfway between the knee and 1. Larger values keep contrast between brighter
/// highlights; smaller ones display moderate highlights brighter.
const SHOULDER: f64 = 0.6;

/// Maps linear sRGB, multiplied by `2^stops`, to [0, 1] for [`super::srgb_encode`].
///
/// Products whose largest channel is at most `KNEE`, 0.8, are kept. All channels of brighter ones are multiplied by one
/// factor, which keeps their hue. Negative channels and NaN become 0. A colour with an infinite channel, for which
/// the curve is not defined, is kept and exceeds 1.
///
/// ```
/// use sunbeam::colour::tone_map;
///
/// assert_eq!(tone_map([0.1, 0.2, 0.4], 1.0), [0.2, 0.4, 0.8]);
/// assert!(tone_map([100.0, 50.0, 0.0], 0.0)[0] < 1.0);
/// ```
pub fn tone_map(linear: [f64; 3], stops: f64) -> [f64; 3] {
    let exposed = linear.map(|channel| (channel * stops.exp2()).max(0.0));
    let peak = exposed[0].max(exposed[1]).max(exposed[2]);
    let excess = peak - KNEE;
    if !(excess > 0.0 && peak.is_finite()) {
        return exposed;
    }
    let factor = (KNEE + (1.0 - KNEE) * excess / (excess + SHOULDER)) / peak;
    exposed.map(|channel| channel * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn highlights_keep_their_hue_and_stay_below_one() {
        assert_eq!(tone_map([0.1, 0.2, -0.1], 1.0), [0.2, 0.4, 0.0]);
        let [r, g, b] = tone_map([1.4, 0.7, 0.0], 0.0);
        // An excess of 0.6 is displayed halfway between the knee and 1.
        assert!((r - 0.9).abs() < 1e-15 && (g - 0.45).abs() < 1e-15 && b == 0.0);
        assert!(tone_map([1e30; 3], 0.0).iter().all(|value| *value <= 1.0));
        assert!(tone_map([f64::NAN, 0.5, 0.5], 0.0).iter().all(|value| value.is_finite()));
    }
}
