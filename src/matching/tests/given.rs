//! Pairs that are given: they decide where the search goes, and are kept.

use super::*;

/// The same pairs with some given.
fn found_around(
    source: &Shape,
    target: &Shape,
    given: &[[u32; 2]],
    options: &MatchOptions,
) -> Matching {
    let given = Correspondences {
        notes: Vec::new(),
        pairs: given.to_vec(),
        confidence: Vec::new(),
    };
    let report = &mut |_, _, _| {};
    match_shapes(source, target, &given, options, report).expect("matched")
}

/// The point of each that is nearest to a place before and after a motion.
fn pair_at(
    place: Point,
    points: [&[(Point, Point)]; 2],
    target: &Shape,
    motion: impl Fn(Point) -> Point,
) -> [u32; 2] {
    let nearest = |all: &mut dyn Iterator<Item = Point>, to: Point| {
        let apart = all.map(|x| length(difference(x, to)));
        let (k, _) = (0u32..)
            .zip(apart)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("points");
        k
    };
    let source = nearest(&mut points[0].iter().map(|point| point.0), place);
    let goal = motion(points[0][source as usize].0);
    [
        source,
        nearest(&mut target.mesh.vertices.iter().copied(), goal),
    ]
}

#[test]
fn three_given_pairs_turn_a_symmetric_body_that_is_else_matched_the_wrong_way_round() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut bar =
        || Vec::from_iter((0..3000).map(|_| on_box([0.0; 3], [1.0, 0.12, 0.2], &mut rng)));
    let (first, second) = (bar(), bar());
    // Half a turn about z takes the bar to itself; it is bent too, so that it does not move rigidly.
    let motion = |x: Point| bent([-x[0], -x[1], x[2]], 0.8);
    let source = cloud(&first, |x| x);
    let target = cloud(&second, motion);
    let truth = |vertex: u32| motion(first[vertex as usize].0);
    let alone = found(&source, &target, &small()).expect("matched");
    let off = errors(&alone, truth, &target);
    // Nothing says that it was turned: the ends are exchanged.
    assert!(at(&off, 0.5) > 0.2, "{}", at(&off, 0.5));
    let places = [[0.5, 0.06, 0.1], [-0.5, 0.06, -0.1], [0.0, -0.06, 0.1]];
    let given = places.map(|place| pair_at(place, [&first, &second], &target, motion));
    let held = found_around(&source, &target, &given, &small());
    let off = errors(&held, truth, &target);
    // As exact as `the_bend_of_a_bar_is_recovered`.
    assert!(at(&off, 0.5) < 0.02, "{}", at(&off, 0.5));
    assert!(at(&off, 0.95) < 0.04, "{}", at(&off, 0.95));
    assert!(held.pairs.len() > 1000, "{}", held.pairs.len());
    assert_eq!(held.given, 3);
}

#[test]
fn given_pairs_move_limbs_that_are_else_taken_for_each_other() {
    let (first, second) = (fork(3000, 6), fork(3000, 7));
    let points =
        |fork: &[((Point, Point), Option<bool>)]| Vec::from_iter(fork.iter().map(|point| point.0));
    let (first_points, second_points) = (points(&first), points(&second));
    // The prongs change places: each ends a little beyond where the other was, one above the other on the way.
    let crossed = |x: Point| {
        let share = (x[0].max(0.0) / 0.8).min(1.0);
        let side = if x[1] > 0.0 { 1.0 } else { -1.0 };
        [
            x[0],
            x[1] - side * share * 0.3,
            x[2] + side * 0.06 * (share * 3.0).min(1.0),
        ]
    };
    let source = cloud(&first_points, |x| x);
    let target = cloud(&second_points, crossed);
    let options = MatchOptions {
        aligned: true,
        ..small()
    };
    let right = |matching: &Matching| {
        let prongs = matching.pairs.iter().filter_map(|pair| {
            let from = first[pair.source as usize].1?;
            Some((from, second[pair.target as usize].1?))
        });
        let (same, all) = prongs.fold((0, 0), |(same, all), (from, to)| {
            (same + usize::from(from == to), all + 1)
        });
        same as f64 / f64::from(all)
    };
    let alone = right(&found(&source, &target, &options).expect("matched"));
    let places = [[0.8, 0.055, 0.0], [0.8, -0.055, 0.0]];
    let given =
        places.map(|place| pair_at(place, [&first_points, &second_points], &target, crossed));
    let held = found_around(&source, &target, &given, &options);
    let with = right(&held);
    println!("alone {alone}, with {with}, {} pairs", held.pairs.len());
    assert!(
        alone < 0.5 && with > 0.95,
        "{alone} alone, {with} with pairs"
    );
}

#[test]
fn given_pairs_are_kept_as_they_are_and_stand_for_their_vertices() {
    let shape = cloud(&odd_body(800, 2), |x| x);
    let options = MatchOptions {
        nodes: 150,
        // Given pairs that are wrong spoil the rest.
        least_confidence: 0.0,
        count: Some(30),
        ..small()
    };
    let given = Correspondences {
        notes: Vec::new(),
        pairs: vec![[5, 6], [700, 0], [5, 9]],
        confidence: vec![0.25, 1.0, 1.0],
    };
    let matching = match_shapes(&shape, &shape, &given, &options, &mut |_, _, _| {});
    let pairs = matching.expect("matched").pairs;
    assert_eq!(pairs.len(), 30);
    assert!(pairs.is_sorted_by_key(|pair| pair.source));
    let with =
        |pair: &&MatchedPair| [5, 700].contains(&pair.source) || [6, 0, 9].contains(&pair.target);
    let found: Vec<_> = pairs.iter().filter(with).collect();
    let found: Vec<_> = found
        .iter()
        .map(|p| (p.source, p.target, p.confidence))
        .collect();
    assert_eq!(found, [(5, 6, 0.25), (5, 9, 1.0), (700, 0, 1.0)]);
}
