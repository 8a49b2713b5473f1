//! Helpers of the realtime renderer's tests: the adapter to test on, and methods without a height field.
#![allow(dead_code, reason = "each binary uses some of them")]

use std::borrow::Cow;
use sunbeam::methods::{MethodShader, Relief};
use sunbeam_realtime::{AdapterChoice, Gpu, GpuError, Query};

/// The adapter that `SUNBEAM_ADAPTER` chooses; `None` without any adapter.
pub(crate) fn gpu() -> Option<Gpu> {
    match Gpu::open(AdapterChoice::from_env().unwrap()) {
        Ok(gpu) => Some(gpu),
        Err(error @ GpuError::NoAdapter { .. }) => {
            sunbeam_testing::skip("gpu", error);
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A method whose response is 1 for all directions.
pub(crate) struct White;

impl Relief for White {
    fn relief_rgb(&self, _: [f32; 3]) -> [f32; 3] {
        [1.0; 3]
    }

    fn relief_spectral(&self, _: [f32; 3], _: f32) -> Option<f32> {
        Some(1.0)
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        MethodShader {
            name: "white",
            wgsl: vec!["fn relief_rgb(q: vec3<f32>) -> vec3<f32> { return vec3<f32>(1.0); }"],
            uniform: vec![0; 16],
            storage: Vec::new(),
        }
    }
}

/// A method with a uniform and two buffers: a glossy lobe around the mirror direction, whose colour depends on u.
pub(crate) struct Lobe {
    pub sharpness: f32,
    pub colours: Vec<[f32; 4]>,
    pub heights: Vec<f32>,
}

impl Default for Lobe {
    fn default() -> Self {
        let colours = vec![[1.0, 0.1, 0.0, 0.0], [0.2, 0.8, 0.1, 0.0], [0.0, 0.2, 1.0, 0.0]];
        Self { sharpness: 4.0, colours, heights: vec![1.0, 2.0, 3.0] }
    }
}

impl Relief for Lobe {
    fn relief_rgb(&self, q: [f32; 3]) -> [f32; 3] {
        let i = (((q[0] + 2.0) * 0.75) as usize).min(2);
        let height = self.heights[i] * (-self.sharpness * (q[0] * q[0] + q[1] * q[1])).exp();
        std::array::from_fn(|c| height * self.colours[i][c])
    }

    fn relief_spectral(&self, _: [f32; 3], _: f32) -> Option<f32> {
        None
    }

    fn relief_shader(&self) -> MethodShader<'_> {
        MethodShader {
            name: "lobe",
            wgsl: vec![
                "
                struct Lobe { sharpness: f32 }
                @group(1) @binding(0) var<uniform> lobe: Lobe;
                @group(1) @binding(1) var<storage, read> lobe_colours: array<vec4<f32>>;
                @group(1) @binding(2) var<storage, read> lobe_heights: array<f32>;
                fn relief_rgb(q: vec3<f32>) -> vec3<f32> {
                    let i = min(u32((q.x + 2.0) * 0.75), 2u);
                    return lobe_heights[i] * exp(-lobe.sharpness * dot(q.xy, q.xy)) * lobe_colours[i].rgb;
                }",
            ],
            uniform: bytes_of(&[self.sharpness, 0.0, 0.0, 0.0]),
            storage: vec![Cow::Owned(bytes_of(self.colours.as_flattened())), Cow::Owned(bytes_of(&self.heights))],
        }
    }
}

fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Single-precision directions of a pair.
pub(crate) fn query(wi: [f64; 3], wo: [f64; 3]) -> Query {
    Query::new(wi.map(|c| c as f32), wo.map(|c| c as f32))
}

/// The largest of `|a − b| / (|b| + floor)` over all components; NaN anywhere gives infinity.
pub(crate) fn worst(found: &[[f32; 3]], expected: &[[f32; 3]], floor: f32) -> f32 {
    assert_eq!(found.len(), expected.len());
    let error = |(a, b): (&f32, &f32)| {
        let error = (a - b).abs() / (b.abs() + floor);
        if error.is_nan() { f32::INFINITY } else { error }
    };
    found.as_flattened().iter().zip(expected.as_flattened()).map(error).fold(0.0, f32::max)
}

/// The largest difference of a channel, relative to the brightest channel of its pair or a floor.
pub(crate) fn worst_of_pairs(found: &[[f32; 3]], expected: &[[f32; 3]], floor: f32) -> f32 {
    let brightest = |rgb: &[f32; 3]| rgb.iter().fold(floor, |most, value| most.max(value.abs()));
    let error = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max) / brightest(b);
    found
        .iter()
        .zip(expected)
        .map(error)
        .fold(0.0, |most, error| if error.is_nan() { f32::INFINITY } else { most.max(error) })
}
