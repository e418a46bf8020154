//! Vertices at the same place become one: for formats that state a vertex anew for each triangle or seam.

use rustc_hash::FxHashMap;

/// Places, each once, in the order of their first use.
#[derive(Default)]
pub(super) struct Weld {
    /// The places.
    pub vertices: Vec<[f64; 3]>,
    numbers: FxHashMap<[u64; 3], u32>,
}

impl Weld {
    /// The number of a place. Only equal coordinates are one place; 0 and -0 are equal.
    pub(super) fn number(&mut self, place: [f64; 3]) -> u32 {
        // -0 + 0 is 0.
        let bits = place.map(|coordinate| (coordinate + 0.0).to_bits());
        let next = self.vertices.len() as u32;
        let number = *self.numbers.entry(bits).or_insert(next);
        if number == next {
            self.vertices.push(place);
        }
        number
    }
}

/// Whether a triangle has three different corners. One that has not has no area, and shares an edge with itself.
pub(super) fn has_area([a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_places_are_one_and_near_ones_are_not() {
        let mut weld = Weld::default();
        let places = [
            [0.0, -0.0, 1.0],
            [1.0; 3],
            [-0.0, 0.0, 1.0],
            [1.0 + 1e-15; 3],
        ];
        assert_eq!(places.map(|place| weld.number(place)), [0, 1, 0, 2]);
        assert_eq!(weld.vertices.len(), 3);
        assert!(has_area(&[0, 1, 2]) && !has_area(&[0, 1, 0]));
    }
}
