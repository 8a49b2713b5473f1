//! A tree of axis-aligned bounding boxes over the triangles of a mesh, for rays (trace.wgsl). The crate `bvh` builds
//! it.

use super::layout::Node;
use super::mesh::Mesh;
use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use bvh::bvh::Bvh;
use nalgebra::Point3;

/// A triangle for the builder of the tree.
struct Shape {
    bounds: Aabb<f32, 3>,
    /// Index of the triangle's node; the builder requires a place for it, and nothing reads it here.
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// The tree as a list in depth-first order; trace.wgsl explains the members `triangle` and `next`.
pub(super) fn tree(mesh: &Mesh) -> Vec<Node> {
    let mut shapes: Vec<Shape> = mesh
        .triangles
        .iter()
        .map(|corners| {
            let point = |i: usize| Point3::from(mesh.positions[corners[i] as usize]);
            Shape { bounds: Aabb::empty().grow(&point(0)).grow(&point(1)).grow(&point(2)), node: 0 }
        })
        .collect();
    Bvh::build_par(&mut shapes).flatten_custom(&|bounds, _, next, triangle| Node {
        low: bounds.min.into(),
        triangle,
        high: bounds.max.into(),
        next,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snake::{SnakeMesh, SnakeOptions};

    #[test]
    fn every_triangle_is_one_leaf_inside_its_boxes() {
        let options = SnakeOptions { half_cells: 1, ..Default::default() };
        let mesh = Mesh::from(&SnakeMesh::build(&options).unwrap());
        let nodes = tree(&mesh);
        let mut seen = vec![0; mesh.triangles.len()];
        // Boxes around the present node, with the ends of their subtrees.
        let mut open: Vec<(&Node, usize)> = Vec::new();
        for (index, node) in nodes.iter().enumerate() {
            open.retain(|&(_, end)| index < end);
            assert!(node.next as usize > index && node.next as usize <= nodes.len());
            if node.triangle == u32::MAX {
                open.push((node, node.next as usize));
                continue;
            }
            assert_eq!(node.next as usize, index + 1);
            seen[node.triangle as usize] += 1;
            for corner in mesh.triangles[node.triangle as usize] {
                let p = mesh.positions[corner as usize];
                for (around, _) in &open {
                    assert!((0..3).all(|c| around.low[c] <= p[c] && p[c] <= around.high[c]));
                }
            }
        }
        assert!(seen.iter().all(|&count| count == 1));
    }
}
