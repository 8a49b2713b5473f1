//! Raises a table until it is not below what is asked for at places between its nodes.

use super::AlbedoLayout;
use super::build::{Nodes, Source};
use super::grid::place;
use crate::numeric::Plain;
use crate::table::{Progress, Steps, WAVELENGTH_MAX_NM, WAVELENGTH_MIN_NM};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Width, in radii of the disc, of the ring that is about the horizon.
const RIM_WIDTH: f64 = 0.3;
/// Rounds of looking. All but the first look again about places where something was lacking, since there is a ridge, and more may lack along it.
const ROUNDS: usize = 3;
/// What a divisor may lack, as a share of it, and not be looked at again.
const LACKING: f64 = 1e-3;

/// A place that is looked at.
#[derive(Clone, Copy)]
struct Look {
    /// In cells along x and y.
    at: [f64; 2],
    /// From zero for the first plane to one for the last.
    plane: f64,
    /// The order whose ridge this plane's wavelength is on, if it was chosen for that (`Lobes::ridge_nm`).
    order: Option<usize>,
}

/// What a table lacks at a place.
struct Lack<const K: usize> {
    /// The place, where it is to be looked at again.
    look: Option<Look>,
    /// The nodes around it with their weights, and by how much they are too low, of each plane of the group.
    corners: [[(usize, f64); 8]; K],
    by: [f64; K],
}

impl<const K: usize> Source<'_, K> {
    /// Raises `nodes` by what is found lacking at some 10⁴ to 10⁵ places.
    pub(super) fn raise(&self, nodes: &mut Nodes, progress: &Progress) {
        let layout = nodes.layout;
        let known = Nodes { layout, values: nodes.values.clone() };
        let first = gaps::<K>(&layout)
            * (self.fineness.samples * layout.cells_in_plane() + self.fineness.rim_samples * layout.cells as usize);
        let again = self.fineness.again;
        let mut lacking: Vec<Look> = Vec::new();
        for round in 0..ROUNDS {
            let looks: Vec<Look> = if round == 0 {
                (0..first).into_par_iter().map(|i| self.look(&layout, i)).collect()
            } else {
                let about = |i: usize| self.look_about(&layout, &lacking[i / again], round, i);
                (0..lacking.len() * again).into_par_iter().filter_map(about).collect()
            };
            // There are fewer places each time.
            let [done, then] = [round, round + 1].map(|round| 1.0 - 0.3f64.powi(round as i32));
            let steps = progress.part(done, then).of_steps(looks.len());
            lacking = self.raise_at(&looks, &known, nodes, &steps);
        }
    }

    /// The `i`-th place of the first round.
    fn look(&self, layout: &AlbedoLayout, i: usize) -> Look {
        let (cells, gaps) = (layout.cells as usize, gaps::<K>(layout));
        let samples = self.fineness.samples;
        let [a, b, towards] = scattered(i);
        let (gap, k) = (i % gaps, i / gaps);
        let on_disc = |at: [f64; 2]| at.map(|along| 0.5 * cells as f64 * (1.0 + along));
        let at = if k < samples * layout.cells_in_plane() {
            [(k / samples % cells) as f64 + a, (k / samples / cells) as f64 + b]
        } else if self.lobes.is_mirrored() && k % 2 == 1 {
            // Every other place about the horizon does for its mirror image as well. The rest are on the axes, where ridges meet their own
            // mirror images.
            let along = 2.0 * b - 1.0;
            on_disc(if a < 0.5 { [along, 0.0] } else { [0.0, along] })
        } else {
            let (sin, cos) = (TAU * b).sin_cos();
            on_disc([cos, sin].map(|along| (1.0 - RIM_WIDTH * a * a) * along))
        };
        // A little beyond the range and brought back, since the last planes have a gap on one side alone.
        let plane = ((gap as f64 + 1.5 * towards - 0.25) / gaps as f64).clamp(0.0, 1.0);
        let order = (i % 2 == 0).then_some(i / 2);
        match order.and_then(|order| self.ridge_plane(layout, at, order)) {
            Some(plane) => Look { at, plane, order },
            None => Look { at, plane, order: None },
        }
    }

    /// The `i`-th place about one where something was lacking, along its ridge if it has one; `None` where that ends.
    fn look_about(&self, layout: &AlbedoLayout, lacking: &Look, round: usize, i: usize) -> Option<Look> {
        let width = 1.0 / round as f64;
        let [x, y, towards] = scattered(i).map(|t| (t - 0.5) * width);
        let at = [lacking.at[0] + x, lacking.at[1] + y];
        let plane = match lacking.order {
            Some(order) => self.ridge_plane(layout, at, order)?,
            None => (lacking.plane + towards / gaps::<K>(layout) as f64).clamp(0.0, 1.0),
        };
        Some(Look { at, plane, ..*lacking })
    }

    /// Where a narrow order's ridge is, from zero for the shortest wavelength to one for the longest.
    fn ridge_plane(&self, layout: &AlbedoLayout, at: [f64; 2], order: usize) -> Option<f64> {
        let nm = self.lobes.ridge_nm(layout.direction(at).0, order)?;
        Some((nm - WAVELENGTH_MIN_NM) / (WAVELENGTH_MAX_NM - WAVELENGTH_MIN_NM))
    }

    /// Raises `nodes` to what is asked for at each of the places, with `known` in the integral; and the places where they lacked it.
    fn raise_at(&self, looks: &[Look], known: &Nodes, nodes: &mut Nodes, steps: &Steps) -> Vec<Look> {
        let layout = nodes.layout;
        let lack = |look: &Look| {
            steps.one();
            let (wi, radius) = layout.direction(look.at);
            if radius >= 1.0 {
                return None;
            }
            let (group, place) = ((self.group)(look.plane), place::<Plain<f64>>(layout.cells, wi));
            let planes = group.planes.map(|plane| layout.between(plane));
            let had = planes.each_ref().map(|planes| nodes.value(planes, &place));
            let asked = self.least(wi, &group, Some(known), had);
            let by = std::array::from_fn::<_, K, _>(|k| asked[k] - had[k]);
            let share = |k: usize| by[k] * place.per_squared_cosine / (1.0 + had[k] * place.per_squared_cosine);
            by.iter().any(|&by| by > 0.0).then(|| Lack {
                look: (0..K).any(|k| share(k) > LACKING).then_some(*look),
                corners: planes.each_ref().map(|planes| layout.around(planes, &place)),
                by,
            })
        };
        let lacks: Vec<Lack<K>> = looks.par_iter().filter_map(lack).collect();
        let mut most = vec![0f32; nodes.values.len()];
        for (corners, by) in lacks.iter().flat_map(|lack| lack.corners.iter().zip(lack.by)) {
            let squares: f64 = corners.iter().map(|corner| corner.1 * corner.1).sum();
            for &(node, weight) in corners {
                // Times their weights these sum to what is lacking.
                most[node] = most[node].max((by * weight / squares) as f32);
            }
        }
        let mirrored = self.lobes.is_mirrored();
        for (node, value) in nodes.values.iter_mut().enumerate() {
            *value += if mirrored { most[node].max(most[layout.mirrored(node)]) } else { most[node] };
        }
        lacks.into_iter().filter_map(|lack| lack.look).collect()
    }
}

/// Gaps between groups of `K` planes, one of which is there where there is one group.
fn gaps<const K: usize>(layout: &AlbedoLayout) -> usize {
    (layout.planes as usize / K - 1).max(1)
}

/// A point of an additive sequence, any few neighbours of which lie evenly in the unit cube (reciprocal powers of the root of
/// x⁴ = x + 1).
fn scattered(i: usize) -> [f64; 3] {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * i as f64).fract())
}
