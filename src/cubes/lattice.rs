//! The values of a field at the nodes of a grid, stored only where there are any.
//!
//! Nodes live in blocks of 4 x 4 x 4 in a hash map: a surface band at resolution N fills O(N²)
//! blocks, where a dense array would take N³ values.

use rustc_hash::FxHashMap;

/// A grid node by its three indices.
pub(super) type Node = [u32; 3];

/// Nodes along one side of a block; a power of two.
const SIDE: u32 = 4;
const NODES_PER_BLOCK: usize = (SIDE * SIDE * SIDE) as usize;
/// Bits per index in a key: resolutions up to 2048 have 2049 nodes in a row.
const INDEX_BITS: u32 = 20;

/// No field value is ever one of these two: `search.rs` refuses values that are not finite.
const UNKNOWN: f32 = f32::NAN;
const AWAITED: f32 = f32::INFINITY;

/// Values at grid nodes; each node is unknown, awaited or known.
pub(super) struct Lattice {
    blocks: FxHashMap<u64, [f32; NODES_PER_BLOCK]>,
}

impl Lattice {
    pub(super) fn new() -> Self {
        Self {
            blocks: FxHashMap::default(),
        }
    }

    /// Marks an unknown node as awaited; whether it was unknown until now.
    #[inline]
    pub(super) fn await_value(&mut self, node: Node) -> bool {
        let value = self.slot(node);
        let unknown = value.is_nan();
        if unknown {
            *value = AWAITED;
        }
        unknown
    }

    #[inline]
    pub(super) fn set(&mut self, node: Node, value: f32) {
        *self.slot(node) = value;
    }

    #[inline]
    pub(super) fn get(&self, node: Node) -> Option<f32> {
        let value = self.blocks.get(&block_key(node))?[place_in_block(node)];
        value.is_finite().then_some(value)
    }

    /// The values of several nodes, if all are known. A block is looked up anew only when it is
    /// not that of the node before, so neighbours should follow each other.
    pub(super) fn get_all<const N: usize>(&self, nodes: [Node; N]) -> Option<[f32; N]> {
        let mut values = [UNKNOWN; N];
        let mut last = (u64::MAX, None);
        for (value, node) in values.iter_mut().zip(nodes) {
            let key = block_key(node);
            if key != last.0 {
                last = (key, self.blocks.get(&key));
            }
            *value = last.1?[place_in_block(node)];
        }
        values
            .iter()
            .all(|value| value.is_finite())
            .then_some(values)
    }

    /// All known nodes with their values, in an order that depends on nothing but the nodes.
    pub(super) fn known(&self) -> impl Iterator<Item = (Node, f32)> {
        let mut keys: Vec<u64> = self.blocks.keys().copied().collect();
        keys.sort_unstable();
        keys.into_iter().flat_map(move |key| {
            let corner = unpack(key).map(|index| index * SIDE);
            let values = self.blocks[&key];
            (0..NODES_PER_BLOCK)
                .filter(move |&place| values[place].is_finite())
                .map(move |place| {
                    let offset = place as u32;
                    let within = [offset % SIDE, offset / SIDE % SIDE, offset / SIDE / SIDE];
                    (
                        std::array::from_fn(|axis| corner[axis] + within[axis]),
                        values[place],
                    )
                })
        })
    }

    #[inline]
    fn slot(&mut self, node: Node) -> &mut f32 {
        let block = self
            .blocks
            .entry(block_key(node))
            .or_insert_with(|| [UNKNOWN; NODES_PER_BLOCK]);
        &mut block[place_in_block(node)]
    }
}

#[inline]
fn block_key(node: Node) -> u64 {
    let [x, y, z] = node;
    pack([x / SIDE, y / SIDE, z / SIDE])
}

#[inline]
fn place_in_block(node: Node) -> usize {
    let [x, y, z] = node;
    (x % SIDE + SIDE * (y % SIDE + SIDE * (z % SIDE))) as usize
}

/// Three indices in one key; z counts most, so that keys sort into layers.
#[inline]
pub(super) fn pack([x, y, z]: [u32; 3]) -> u64 {
    u64::from(x) | u64::from(y) << INDEX_BITS | u64::from(z) << (2 * INDEX_BITS)
}

fn unpack(key: u64) -> [u32; 3] {
    let mask = (1_u64 << INDEX_BITS) - 1;
    [0, 1, 2].map(|axis| (key >> (axis * INDEX_BITS) & mask) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_awaited_once_and_then_known() {
        let mut lattice = Lattice::new();
        let node = [2048, 0, 7];
        assert_eq!(lattice.get(node), None);
        assert!(lattice.await_value(node), "unknown before");
        assert!(!lattice.await_value(node), "awaited already");
        assert_eq!(lattice.get(node), None);
        lattice.set(node, -0.5);
        assert!(!lattice.await_value(node), "known");
        assert_eq!(lattice.get(node), Some(-0.5));
    }

    #[test]
    fn several_nodes_are_known_only_if_each_is() {
        let mut lattice = Lattice::new();
        let nodes = [[3, 0, 0], [4, 0, 0], [3, 0, 4]];
        nodes
            .iter()
            .zip([1.0, 2.0, 3.0])
            .for_each(|(&node, value)| lattice.set(node, value));
        assert_eq!(lattice.get_all(nodes), Some([1.0, 2.0, 3.0]));
        assert_eq!(
            lattice.get_all([nodes[0], [2, 0, 0]]),
            None,
            "unknown in a known block"
        );
        lattice.await_value([2, 0, 0]);
        assert_eq!(lattice.get_all([nodes[0], [2, 0, 0]]), None, "awaited");
        assert_eq!(
            lattice.get_all([nodes[0], [99, 0, 0]]),
            None,
            "no such block"
        );
    }

    #[test]
    fn known_nodes_come_back_in_the_same_order_however_they_were_set() {
        let nodes = [
            [0, 0, 0],
            [3, 1, 2],
            [4, 0, 0],
            [2048, 2048, 2048],
            [5, 1023, 9],
        ];
        let filled = |order: &[usize]| {
            let mut lattice = Lattice::new();
            order.iter().for_each(|&i| lattice.set(nodes[i], i as f32));
            lattice.known().collect::<Vec<_>>()
        };
        let listed = filled(&[0, 1, 2, 3, 4]);
        assert_eq!(listed, filled(&[4, 2, 0, 3, 1]));
        assert_eq!(listed.len(), nodes.len());
        for (node, value) in listed {
            assert_eq!(nodes[value as usize], node);
        }
    }
}
