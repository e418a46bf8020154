//! Which nodes are evaluated, on fields that are known.

use super::*;
use crate::cubes::polygonise::polygonise;

type Answer = Result<Vec<f32>, std::convert::Infallible>;

fn grid(resolution: usize) -> Grid {
    Grid::new([-1.0; 3], [1.0; 3], resolution).expect("a good grid")
}

/// A sphere of radius 0.6.
fn sphere(points: &[[f32; 3]]) -> Answer {
    Ok(points
        .iter()
        .map(|[x, y, z]| x.hypot(*y).hypot(*z) - 0.6)
        .collect())
}

#[test]
fn following_from_one_cell_finds_the_whole_surface_and_hardly_more() {
    let grid = grid(64);
    let mut whole = Search::new(&grid, sphere);
    whole.find_surface().expect("a field without errors");
    let mut followed = Search::new(&grid, sphere);
    // The cell on the x axis at 0.6: 0.6 / (2 / 64) = 19.2 cells from the middle.
    followed
        .complete(&[[32 + 19, 32, 32]], 1)
        .expect("a field without errors");
    followed.follow().expect("a field without errors");
    assert!(
        followed.evaluated < whole.evaluated / 2,
        "{}",
        followed.evaluated
    );
    let (found, _) = polygonise(&mut followed).expect("a field without errors");
    assert_eq!(
        found,
        polygonise(&mut whole).expect("a field without errors").0
    );
    assert!(found.is_closed());
}

#[test]
fn the_scan_has_32_to_63_cells_where_the_grid_has_as_many() {
    for resolution in [8, 31, 32, 63, 64, 100, 255, 256, 1000, 2048] {
        let grid = grid(resolution);
        let stride = Search::new(&grid, sphere).scan_stride() as usize;
        assert!(stride.is_power_of_two(), "{stride}");
        let scanned = resolution / stride;
        let enough = if resolution < 64 {
            stride == 1
        } else {
            (32..64).contains(&scanned)
        };
        assert!(enough, "{scanned} cells in the scan of {resolution}");
    }
}

#[test]
fn the_slope_of_a_linear_field_is_found_along_every_diagonal() {
    // Along an edge, a diagonal of a face, and one of the cell: each exact.
    for direction in [[0.0, 2.0, 0.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 1.0]] {
        let grid = grid(8);
        let linear = |points: &[[f32; 3]]| -> Answer {
            let at = |x: &[f32; 3]| (0..3).map(|axis| x[axis] * direction[axis]).sum();
            Ok(points.iter().map(at).collect())
        };
        let mut search = Search::new(&grid, linear);
        search
            .complete(&[[2, 4, 6]], 2)
            .expect("a field without errors");
        let length = direction.map(|part| part * part).iter().sum::<f32>().sqrt();
        let steepest = search.steepest(&[[2, 4, 6]], 2) / grid.spacing() as f32;
        // f32 rounding of differences of values near 1.
        assert!((steepest - length).abs() < 1e-5, "{steepest} for {length}");
    }
}

#[test]
fn a_cell_is_kept_as_long_as_the_slope_allows_a_zero_in_it() {
    let grid = grid(8);
    // A cone with its tip, the only zero, at the corner of the cell: the limit of the bound.
    let cone = |points: &[[f32; 3]]| -> Answer {
        Ok(points
            .iter()
            .map(|[x, y, z]| x.hypot(*y).hypot(*z))
            .collect())
    };
    let mut search = Search::new(&grid, cone);
    search
        .complete(&[[4, 4, 4], [6, 4, 4]], 1)
        .expect("a field without errors");
    let reach = MEAN_DISTANCE * grid.spacing() as f32;
    assert!(search.may_hold_surface([4, 4, 4], 1, reach * 1.0001));
    assert!(!search.may_hold_surface([4, 4, 4], 1, reach * 0.9999));
    assert!(
        !search.may_hold_surface([6, 4, 4], 1, reach * 1.0001),
        "two cells off"
    );
}
