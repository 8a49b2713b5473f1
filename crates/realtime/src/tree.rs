//! A tree of axis-aligned bounding boxes over the triangles of a mesh, built by the crate `bvh`. trace.wgsl uses the
//! tree to intersect rays with the mesh.

use super::layout::Node;
use super::mesh::Mesh;
use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use bvh::bvh::Bvh;
use nalgebra::Point3;

/// Bounding box of a triangle, for the builder of the tree.
struct Leaf {
    bounds: Aabb<f32, 3>,
    /// Index of the leaf's node, which the builder stores here and this file does not read.
    node: usize,
}

impl Bounded<f32, 3> for Leaf {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Leaf {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// The nodes of the tree in depth-first order: the first child of an inner node follows it (trace.wgsl).
pub(super) fn tree(mesh: &Mesh) -> Vec<Node> {
    let mut leaves: Vec<Leaf> = mesh
        .triangles
        .iter()
        .map(|corners| {
            let point = |i: usize| Point3::from(mesh.positions[corners[i] as usize]);
            Leaf { bounds: Aabb::empty().grow(&point(0)).grow(&point(1)).grow(&point(2)), node: 0 }
        })
        .collect();
    // The arguments of the closure are the node's box, the index of its first child, the index after its subtree, and
    // the index of its triangle. An inner node has `u32::MAX` there, `TRACE_NONE` in trace.wgsl. A leaf has an empty
    // box. In a mesh of several triangles the crate puts an inner node with the triangle's box before every leaf.
    Bvh::build_par(&mut leaves).flatten_custom(&|bounds, _, next, triangle| Node {
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
        // Inner nodes above the current node, each with the index after its subtree.
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
                for (ancestor, _) in &open {
                    assert!((0..3).all(|c| ancestor.low[c] <= p[c] && p[c] <= ancestor.high[c]));
                }
            }
        }
        assert!(seen.iter().all(|&count| count == 1));
    }
}
