//! Hierarchies in a time that grows with the number of boxes, however these lie.

use glam::DVec3;
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
    ploc::morton::morton_encode_u64_unorm,
};
use rayon::prelude::*;

/// Least part of the nodes that a pass joins by choice.
const LEAST_PART: usize = 8;

/// A binary tree of these boxes, at least one.
///
/// Boxes are sorted along a space-filling curve, and then joined in passes as in PLOC with a search distance of one (Meister and Bittner,
/// Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction, TVCG 2018): each takes whichever of its two
/// neighbours makes the smaller box with it, and two that take each other become one. Where boxes grow along the curve, as those of
/// triangles around a common vertex do, each takes the one before it and a pass joins a single pair. A pass in which fewer than an
/// eighth would find each other therefore joins the nodes by twos as they stand. So the nodes become fewer by a fixed part in every
/// pass: the time is proportional to their number, and the depth of the tree, which is walked by recursion, to its logarithm.
pub(super) fn tree(boxes: &[Aabb]) -> Bvh2 {
    let mut nodes = along_curve(boxes);
    let mut tree = Bvh2::zeroed(boxes.len());
    tree.primitive_indices = (0..boxes.len() as u32).collect();
    let (mut free, mut passes) = (tree.nodes.len(), 0);
    let (mut costs, mut joined) = (Vec::with_capacity(nodes.len()), Vec::with_capacity(nodes.len()));
    while nodes.len() > 1 {
        costs.clear();
        costs.extend(nodes.windows(2).map(|pair| pair[0].aabb().union(pair[1].aabb()).half_area()));
        let find_each_other =
            |k: usize| (k == 0 || costs[k] <= costs[k - 1]) && costs.get(k + 1).is_none_or(|next| costs[k] < *next);
        let by_choice = LEAST_PART * (0..costs.len()).filter(|&k| find_each_other(k)).count() >= nodes.len();
        let mut k = 0;
        while k < nodes.len() {
            if k < costs.len() && (!by_choice || find_each_other(k)) {
                free -= 2;
                tree.nodes[free..free + 2].copy_from_slice(&nodes[k..k + 2]);
                joined.push(Bvh2Node::new(nodes[k].aabb().union(nodes[k + 1].aabb()), 0, free as u32));
                k += 2;
            } else {
                joined.push(nodes[k]);
                k += 1;
            }
        }
        std::mem::swap(&mut nodes, &mut joined);
        joined.clear();
        passes += 1;
    }
    tree.nodes[0] = nodes[0];
    tree.max_depth = tree.max_depth.max(passes + 1);
    tree.children_are_ordered_after_parents = true;
    tree
}

/// The boxes as leaves, in the order of the Morton codes of their centres.
fn along_curve(boxes: &[Aabb]) -> Vec<Bvh2Node> {
    let whole = boxes.iter().fold(Aabb::empty(), |whole, one| whole.union(one));
    let (least, scale) = (whole.min.as_dvec3(), DVec3::ONE / whole.diagonal().as_dvec3());
    let code = |one: &Aabb| morton_encode_u64_unorm((one.center().as_dvec3() - least) * scale);
    let mut order: Vec<(u64, u32)> = boxes.par_iter().enumerate().map(|(k, one)| (code(one), k as u32)).collect();
    order.par_sort_unstable();
    order.into_par_iter().map(|(_, k)| Bvh2Node::new(boxes[k as usize], 1, k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3A;

    fn depth(tree: &Bvh2, node: usize) -> usize {
        let node = &tree.nodes[node];
        if node.is_leaf() {
            return 1;
        }
        let first = node.first_index as usize;
        1 + depth(tree, first).max(depth(tree, first + 1))
    }

    #[test]
    fn trees_are_shallow_and_whole_however_the_boxes_lie() {
        let growing = |k: usize| Aabb::new(Vec3A::ZERO, Vec3A::new(1.0 + k as f32, 1.0 + 0.5 * k as f32, 1.0));
        let equal = |_: usize| Aabb::new(Vec3A::ZERO, Vec3A::ONE);
        let apart = |k: usize| {
            let corner = Vec3A::new((k % 71) as f32, (k / 71) as f32, (k % 3) as f32);
            Aabb::new(corner, corner + 1.0)
        };
        let makes: [(&str, &dyn Fn(usize) -> Aabb); 3] = [("growing", &growing), ("equal", &equal), ("apart", &apart)];
        for (name, make) in makes {
            for count in [1, 2, 3, 5000] {
                let boxes: Vec<Aabb> = (0..count).map(make).collect();
                let tree = tree(&boxes);
                let found = tree.validate(&boxes, false, true);
                assert_eq!(found.discovered_primitives.len(), count, "{name}");
                let deep = depth(&tree, 0);
                assert!(deep <= 1 + (count as f64).ln().div_euclid((8.0_f64 / 7.0).ln()) as usize, "{name}: {deep}");
            }
        }
    }
}
