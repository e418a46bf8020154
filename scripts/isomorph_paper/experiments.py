"""All experiments of the paper, as data: which sequences, which rows, which picture.

A row is a method and the recipe keys in which it differs. `ours` is the preset `quick` at the small
size and `paper` at the full one, so that each ablation is of the recipe whose size it has. What the
rows of a table have in common is said once, in `keys` of the experiment.
"""

from dataclasses import dataclass

from . import PaperError

OURS = "ours"

# 5 % of the 20,000 points of each shape: the evaluation protocol's (DESIGN, section 4).
POINTS = 20_000
PAIRS = 1_000


@dataclass(frozen=True)
class Size:
    """The budget that every row of a table gets, whichever its method."""

    name: str
    ours: str
    steps: int | None
    """None: those of each preset."""
    batch: int | None
    every: int
    """Every so many frames are evaluated where an experiment does not need them all."""
    network: tuple[str, ...] = ()
    """What makes `ours` one network f(x, t), where the terms of that geometry are studied."""


NETWORK = (
    "implicit.geometry=network",
    "implicit.activation=softplus",
    "implicit.beta=100",
    "velocity.time-dependent=false",
    "loss.screw=0",
    "training.learning-rate=2e-3",
    "training.velocity-until=0.7",
)
SMALL = Size("small", "quick", 1_000, 2_200, every=3, network=NETWORK)
FULL = Size("full", "paper", 10_000, 4_000, every=1)
# Presets as they are.
PRESETS = Size("presets", "instant", None, None, every=3)


@dataclass(frozen=True)
class Subject:
    """A sequence and the pairs of frames that are learned."""

    sequence: str
    pairs: tuple[tuple[int, int], ...]
    made_from: str | None = None
    """The sequence that this one is made of, where it is made here."""


@dataclass(frozen=True)
class Input:
    """Input files that are made for a row; without one, `compare` makes its own."""

    kind: str
    """A maker of inputs.py."""
    amount: float = 0.0
    """The share of pairs that are swapped, or the points of the target."""


@dataclass(frozen=True)
class Row:
    """One line of a table."""

    label: str
    method: str = OURS
    keys: tuple[str, ...] = ()
    """`section.key=value`"""
    at: float | None = None
    """Where it is on the horizontal axis of a sweep."""
    family: str = OURS
    """The line of a sweep that it belongs to."""
    input: Input | None = None
    size: str | None = None
    """The only size at which the row is run."""
    pair: tuple[str, int, int] | None = None
    """The only pair that it is run on."""


@dataclass(frozen=True)
class Experiment:
    """One table or figure of the paper."""

    name: str
    about: str
    subjects: tuple[Subject, ...]
    rows: tuple[Row, ...]
    figure: str = "time"
    """"time": error over time; "sweep": error against `axis`; "volume": volume over time."""
    axis: str = ""
    logarithmic: bool = False
    keys: tuple[str, ...] = ()
    all_frames: bool = False
    network: bool = False
    """Whether the terms under study are those of one network f(x, t)."""
    sizes: tuple[Size, Size] = (SMALL, FULL)
    """For two cores, and with --full."""

    def rows_at(self, size: Size) -> list[Row]:
        return [row for row in self.rows if row.size in (None, size.name)]


FOX = Subject("fox_survey", ((0, 18), (20, 47)))
FOX_HEAD = Subject("fox_survey", ((0, 18),))
BEAR = Subject("bear_walk", ((0, 16), (16, 30), (30, 47)))
BEAR_STEP = Subject("bear_walk", ((30, 47),))
ARMS = Subject("human_raise_arms", ((0, 26),))
# Every pair of the evaluation protocol.
PROTOCOL = (FOX, BEAR, Subject("human_raise_arms", ((0, 26), (26, 53))))
HEAVY = Subject("human_male_to_heavy", ((0, 10),))
FEET = Subject("human_feet_together", ((0, 26),), made_from="human_raise_arms")
# A bar that turns as a whole by so many degrees, its true motion known.
TURNS = tuple(
    Subject(f"bar_turn_{degrees}", ((0, 8),), made_from="bar") for degrees in (90, 120, 150, 170)
)

# Without the terms that are ours, so that the term under study is not covered by another one.
NO_STRAIN = ("loss.strain=0",)
PAPER_TERMS = ("loss.strain=0", "loss.on-surface=0", "loss.transported-normals=0")
SMALL_NETWORKS = (
    "implicit.depth=5",
    "implicit.width=128",
    "velocity.depth=4",
    "velocity.width=96",
)
ROBUST = ("loss.matching-scale=0.03",)
SOFTPLUS = (
    "implicit.activation=softplus",
    "implicit.beta=100",
    "training.learning-rate=2e-3",
)
NO_PRICE = ("loss.screw=0",)


def shares(
    kind: str, percents: tuple[int, ...], keys: tuple[str, ...], family: str
) -> tuple[Row, ...]:
    """A row for each percentage of the pairs."""
    return tuple(
        Row(
            f"{percent} % swapped, {family}".replace(",", ":"),
            OURS,
            keys,
            percent,
            family,
            Input(kind, percent / 100),
        )
        for percent in percents
    )


def integrator(name: str, steps: int) -> tuple[str, ...]:
    """The keys that choose how trajectories are integrated."""
    return (f"training.integrator={name}", f"training.time-steps={steps}")


BASELINES = (
    Row("mlp", "mlp"),
    Row("sdf-blend", "sdf-blend"),
    Row("lipmlp", "lipmlp"),
    Row("nise", "nise"),
    Row("nise-velocity", "nise-velocity"),
    Row("eigenbasis", "eigenbasis"),
    # One optimisation per time makes it hours a pair: one pair is what two cores allow.
    Row("nfgp", "nfgp", pair=("fox_survey", 0, 18)),
)

EXPERIMENTS = (
    Experiment(
        "errors",
        "Error of the shapes in between: every method under one budget, on fox and bear.",
        (FOX, BEAR),
        (
            Row("quick", "quick"),
            Row("quick (one network)", "quick", NETWORK, size="small"),
            Row("default", "default", size="full"),
            Row("paper", "paper", size="full"),
            Row("paper (small networks)", "paper", SMALL_NETWORKS, size="small"),
            *BASELINES,
        ),
        all_frames=True,
    ),
    Experiment(
        "correspondences",
        "Error against the share of the 20,000 points whose correspondence is known.",
        (FOX_HEAD,),
        tuple(
            Row(f"{percent} %", keys=(f"data.correspondence-fraction={percent / 100}",), at=percent)
            for percent in (1, 5, 10, 20)
        ),
        "sweep",
        "known correspondences, % of the points",
        # The frames' own vertices: fox has 4610, the 20 % are 4000 of them.
        keys=("data.correspondences=same-vertices",),
    ),
    Experiment(
        "local-swaps",
        "Error against the share of pairs that got the target of their 5th nearest neighbour.",
        (FOX_HEAD,),
        (
            *shares("local-swaps", (0, 5, 10, 20), (), "plain distance"),
            *shares("local-swaps", (0, 20), ROBUST, "Geman-McClure"),
        ),
        "sweep",
        "pairs swapped with their 5th nearest neighbour, %",
    ),
    Experiment(
        "global-swaps",
        "Error against the share of pairs whose targets are permuted among each other.",
        (FOX_HEAD,),
        (
            *shares("global-swaps", (0, 1, 5, 10), (), "plain distance"),
            *shares("global-swaps", (0, 10), ROBUST, "Geman-McClure"),
        ),
        "sweep",
        "pairs permuted, %",
    ),
    Experiment(
        "level-set",
        "The modified level-set equation (MLSE) against the original with Eikonal terms (OLSE).",
        (FOX_HEAD, ARMS),
        (
            Row("MLSE", keys=("loss.level-set-form=mlse",), size="small"),
            Row("OLSE", keys=("loss.level-set-form=olse",), size="small"),
            Row("MLSE: terms of the paper alone", keys=("loss.level-set-form=mlse", *PAPER_TERMS)),
            Row("OLSE: terms of the paper alone", keys=("loss.level-set-form=olse", *PAPER_TERMS)),
        ),
        network=True,
    ),
    Experiment(
        "divergence",
        "Volume over time with and without the divergence term: a shape that grows, and one not.",
        (HEAVY, ARMS),
        (
            Row("as shipped: with strain", size="small"),
            Row("divergence on", keys=NO_STRAIN),
            Row("divergence off", keys=("loss.divergence=0", *NO_STRAIN)),
        ),
        "volume",
        all_frames=True,
    ),
    Experiment(
        "smoothness",
        "The smoothness term on and off, with 1 % of the correspondences.",
        (FOX_HEAD, ARMS),
        (
            Row("as shipped: with strain", size="small"),
            Row("smoothness on", keys=("loss.smoothness=20", *NO_STRAIN)),
            Row("smoothness off", keys=("loss.smoothness=0", *NO_STRAIN)),
        ),
        keys=("data.correspondence-fraction=0.01",),
        network=True,
    ),
    Experiment(
        "sparse",
        "Error against the points of the target; the source has 20,000, and 1000 pairs are known.",
        (FOX_HEAD,),
        tuple(
            Row(f"{points} points", at=points, input=Input("sparse", points))
            for points in (20_000, 10_000, 5_000, 2_000)
        ),
        "sweep",
        "points of the target",
        logarithmic=True,
    ),
    Experiment(
        "incomplete",
        "Clouds without normals; three holes in the source, three others in the target.",
        (FOX_HEAD, ARMS),
        (
            Row("complete", input=Input("holes", 0)),
            Row(
                "complete: no normals given",
                keys=("data.normals=estimate",),
                input=Input("holes", 0),
            ),
            Row("with holes", input=Input("holes", 3)),
        ),
    ),
    Experiment(
        "topology",
        "The feet merge while the arms rise: the source has genus 0, the target's surface genus 1.",
        (FEET,),
        (
            Row("ours", input=Input("outer-surface")),
            Row("sdf-blend", "sdf-blend", input=Input("outer-surface")),
            Row("lipmlp", "lipmlp", input=Input("outer-surface")),
            Row("nise", "nise", input=Input("outer-surface")),
        ),
    ),
    Experiment(
        "no-correspondences",
        "No correspondence at all, beside methods that never use one.",
        (FOX_HEAD, ARMS),
        (
            Row("5 % known"),
            Row("none known: found by match", keys=("data.correspondences=match",)),
            Row("none known: none sought", keys=("data.correspondences=none",)),
            Row("lipmlp", "lipmlp"),
            Row("nise", "nise"),
        ),
    ),
    Experiment(
        "ablation",
        "Each part of the recipe taken out or exchanged: geometry, priors of V, integrators.",
        (FOX_HEAD, BEAR_STEP, ARMS),
        (
            Row("quick", "quick"),
            Row("quick: seed 1", "quick", ("training.seed=1",)),
            Row("quick: seed 2", "quick", ("training.seed=2",)),
            Row("geometry: one network", "quick", NETWORK),
            Row("geometry: softplus ends", "quick", SOFTPLUS),
            Row("geometry: no distance", "quick", ("loss.distance=0",)),
            Row("V: no on-surface", "quick", ("loss.on-surface=0",)),
            Row("V: stationary", "quick", ("velocity.time-dependent=false", *NO_PRICE)),
            Row("V: time without a price", "quick", NO_PRICE),
            Row("V: no strain", "quick", NO_STRAIN),
            Row("V: strain Huber 0.1", "quick", ("loss.strain-scale=0.1",)),
            Row("V: no divergence", "quick", ("loss.divergence=0",)),
            Row("steps: Euler 8", "quick", integrator("euler", 8)),
            Row("steps: midpoint 3", "quick", integrator("midpoint", 3)),
            Row("steps: RK4 1", "quick", integrator("rk4", 1)),
        ),
    ),
)


INSTANT_ONLY = (PRESETS, PRESETS)

EXPERIMENTS += (
    Experiment(
        "instant-parts",
        "The preset `instant` with each part of it taken out or exchanged.",
        (FOX_HEAD, ARMS),
        (
            Row("instant"),
            Row("seed 1", keys=("training.seed=1",)),
            Row("seed 2", keys=("training.seed=2",)),
            Row("fitted ends (quick)", "quick"),
            Row("grid: spacing .1", keys=("spline.spacing=0.1",)),
            Row("grid: spacing .07", keys=("spline.spacing=0.07",)),
            Row("grid: spacing .035", keys=("spline.spacing=0.035",)),
            Row("grid: no coarse levels", keys=("spline.coarse-shares=[0]",)),
            Row("V: stationary", keys=("velocity.time-dependent=false",)),
            Row("quadrature: 6000 samples", keys=("spline.band=6000",)),
            Row("quadrature: 96000 samples", keys=("spline.band=96000",)),
            Row("tolerance .3", keys=("spline.tolerance=0.3",)),
            Row("tolerance .003", keys=("spline.tolerance=0.003", "spline.iterations=400")),
            Row("steps: 9", keys=("training.steps=9",)),
            Row("steps: 36", keys=("training.steps=36",)),
            Row("path: 1 step", keys=("training.time-steps=1",)),
            Row("path: 6 steps", keys=("training.time-steps=6",)),
            Row("V: no on-surface", keys=("loss.on-surface=0",)),
            Row("V: no divergence", keys=("loss.divergence=0",)),
            Row("V: no screw", keys=("loss.screw=0",)),
            Row("V: strain / 100", keys=("loss.strain=0.03",)),
        ),
        sizes=INSTANT_ONLY,
    ),
    Experiment(
        "instant-inputs",
        "The preset `instant` on hard inputs.",
        (FOX_HEAD, ARMS),
        (
            Row("5 % known"),
            Row("1 % known", keys=("data.correspondence-fraction=0.01",)),
            Row("none known: found by match", keys=("data.correspondences=match",)),
            Row("none known: none sought", keys=("data.correspondences=none",)),
            Row("20 % of the pairs wrong: near", input=Input("local-swaps", 0.2)),
            Row("10 % of the pairs permuted", input=Input("global-swaps", 0.1)),
            Row("clouds with normals", input=Input("holes", 0)),
            Row("clouds without", keys=("data.normals=estimate",), input=Input("holes", 0)),
            Row("clouds with holes", input=Input("holes", 3)),
            Row("2000 points of the target", input=Input("sparse", 2000)),
        ),
        sizes=INSTANT_ONLY,
    ),
    Experiment(
        "instant-volume",
        "The preset `instant` on a person who becomes heavy: the volume grows.",
        (HEAVY,),
        (
            Row("instant"),
            Row("without divergence", keys=("loss.divergence=0",)),
            Row("without divergence and strain", keys=("loss.divergence=0", "loss.strain=0.03")),
            Row("quick without both", "quick", ("loss.divergence=0", "loss.strain=0")),
        ),
        "volume",
        all_frames=True,
        sizes=INSTANT_ONLY,
    ),
    Experiment(
        "large-turns",
        "A bar of 1.6 by .3 by .3 that turns as a whole: the preset `instant` beside networks.",
        TURNS,
        (
            Row("instant"),
            Row("instant: 1 % known", keys=("data.correspondence-fraction=0.01",)),
            Row("instant: none sought", keys=("data.correspondences=none",)),
            Row("quick", "quick"),
            Row("quick without splines", "quick", ("training.guided-until=0",)),
        ),
        all_frames=True,
        sizes=INSTANT_ONLY,
    ),
)


def named(name: str) -> Experiment:
    """The experiment of this name."""
    for experiment in EXPERIMENTS:
        if experiment.name == name:
            return experiment
    names = ", ".join(experiment.name for experiment in EXPERIMENTS)
    raise PaperError(f"{name}: no such experiment; there are {names}, all and list")


def runs_of(experiment: Experiment, size: Size) -> int:
    """How many trainings the experiment takes."""
    return sum(
        sum(row.pair in (None, (subject.sequence, *pair)) for row in experiment.rows_at(size))
        for subject in experiment.subjects
        for pair in subject.pairs
    )
