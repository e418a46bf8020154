"""What a step is made of: networks, numbers of samples, and the operations that they cost.

The Python twin of `src/session/bench.rs` (sizes), `src/training/samples.rs` (numbers of samples) and
`src/training/flop.rs` (operations of the matrix products).
"""

import math
from dataclasses import dataclass

# The preset `paper` (fourth column of src/training/recipe/keys.rs).
FREQUENCIES = 6
BETA = 100.0
BAND_SHARE = 0.75
CORRESPONDENCES = 1000

PHASES = ("warm_up", "joint")


@dataclass(frozen=True)
class Network:
    """Hidden layers, their columns, and the columns that go in and come out."""

    depth: int
    width: int
    inputs: int
    outputs: int

    def layers(self) -> list[tuple[int, int]]:
        """(inputs, outputs) of every layer; the preset has no skip connection."""
        columns = [self.inputs, *[self.width] * self.depth, self.outputs]
        return list(zip(columns, columns[1:]))

    def flop_per_point(self) -> int:
        """Of the matrix products of one evaluation."""
        return sum(2 * a * b for a, b in self.layers())


@dataclass(frozen=True)
class Samples:
    """How many samples of each kind a step takes: `BatchSizes`."""

    ends: int  # given points of each shape
    carried: int  # carried points from each shape
    band: int  # collocation points near the surface
    uniform: int  # collocation points in the box
    matched: int  # correspondences

    @classmethod
    def of(cls, batch: int, known: int = CORRESPONDENCES) -> "Samples":
        ends = max(batch * 2 // 11, 1)
        carried = max(batch * 3 // 22, 1)
        collocation = batch - 2 * (ends + carried)
        # Halves are rounded up, as in Rust; Python's own round() goes to the even number.
        band = math.floor(collocation * BAND_SHARE + 0.5)
        return cls(ends, carried, band, collocation - band, min(CORRESPONDENCES, known))

    def total(self) -> int:
        """Points at which f is evaluated."""
        return 2 * self.ends + 2 * self.carried + self.band + self.uniform


@dataclass(frozen=True)
class Size:
    """A row of `isomorph bench --size`."""

    name: str
    depth: int
    width_f: int
    width_v: int
    batch: int
    time_steps: int

    @property
    def samples(self) -> Samples:
        return Samples.of(self.batch)

    @property
    def f(self) -> Network:
        """Reads the encoded position and the time."""
        return Network(self.depth, self.width_f, encoded_width() + 1, 1)

    @property
    def v(self) -> Network:
        """Reads the encoded position: the preset's V is stationary."""
        return Network(self.depth, self.width_v, encoded_width(), 3)


SIZES = {
    size.name: size
    for size in (
        Size("small", 6, 128, 128, 1000, 5),
        Size("shipped", 8, 256, 256, 4086, 10),
        Size("paper", 8, 512, 256, 4000, 10),
    )
}


def encoded_width(frequencies: int = FREQUENCIES) -> int:
    """Columns of the encoding of a point."""
    return 3 * (2 * frequencies + 1)


def flop_per_step(size: Size, phase: str, shared: bool = False) -> float:
    """Operations of the matrix products of a step, counted as `isomorph bench` counts them.

    With `shared`, the carried points of the joint phase are not carried a second time.
    """
    samples = size.samples
    joint = phase == "joint"
    carried, matched = 2 * samples.carried, 2 * samples.matched
    constants = 0 if joint and shared else carried * size.time_steps
    tracked = (matched + (carried if joint else 0)) * size.time_steps
    # One forward sweep of five lanes (value, three tangents, Laplacian); a tracked product costs
    # itself and one more for each operand.
    jet = 5 * (samples.band + samples.uniform)
    of_v = size.v.flop_per_point() * (constants + 3 * tracked + 3 * jet)
    of_f = size.f.flop_per_point() * 6 * samples.total() if joint else 0
    return float(of_v + of_f)
