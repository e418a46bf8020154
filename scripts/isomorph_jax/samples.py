"""The batches of the steps, drawn by numpy on two spheres of points (`Pair::spheres`)."""

import numpy as np

from .sizes import CORRESPONDENCES, Samples

POINTS = 20_000
RADIUS = 0.28
BAND_WIDTHS = (0.01, 0.05)
BOX_MARGIN = 0.15


def spheres() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source and target, the second 0.2 further along x, and the normals of both; each (n, 3)."""
    k = np.arange(POINTS)
    z = 1 - (2 * k + 1) / POINTS
    ring, angle = np.sqrt(1 - z**2), 2.399963 * k
    normals = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    across = np.array([0.1, 0, 0])
    return RADIUS * normals - across, RADIUS * normals + across, normals


def draw(samples: Samples, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The samples of one step; float32, points (n, 3), times (n, 1)."""
    source, target, normals = spheres()
    clouds = (source, target)
    ends, starts = (
        [rng.integers(POINTS, size=count) for _ in clouds]
        for count in (samples.ends, samples.carried)
    )
    both = lambda chosen: np.concatenate([cloud[k] for cloud, k in zip(clouds, chosen)])
    zeros_and_ones = lambda count: np.repeat([0.0, 1.0], count)[:, None]
    # A twelfth of the times on each end.
    times = lambda count: np.clip(rng.uniform(-0.1, 1.1, (count, 1)), 0, 1)
    low = np.minimum(source.min(0), target.min(0)) - BOX_MARGIN
    high = np.maximum(source.max(0), target.max(0)) + BOX_MARGIN
    known = rng.integers(CORRESPONDENCES, size=samples.matched)
    widths = rng.choice(BAND_WIDTHS, (samples.band, 1))
    drawn = {
        "ends": both(ends),
        "end_times": zeros_and_ones(samples.ends),
        "end_normals": np.concatenate([normals[k] for k in ends]),
        "starts": both(starts),
        "start_times": zeros_and_ones(samples.carried),
        "stops": times(2 * samples.carried),
        "offsets": widths * rng.standard_normal((samples.band, 3)),
        "uniform": rng.uniform(low, high, (samples.uniform, 3)),
        "uniform_times": times(samples.uniform),
        "matched_source": source[known],
        "matched_target": target[known],
    }
    return {name: values.astype(np.float32) for name, values in drawn.items()}
