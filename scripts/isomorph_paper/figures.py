"""The picture of an experiment, drawn by matplotlib; the same numbers give the same SVG."""

import importlib.util
import io
import re

from . import PaperError
from .experiments import Experiment
from .report import by_sequence, mean_of
from .runs import Measured

# Okabe and Ito's colours, which are told apart without seeing red or green; grey is for references.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C6D00")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
GREY = "#808080"

CD = "CD $\\times 10^3$"


def check() -> None:
    """A PaperError where matplotlib is missing: better before the runs than after."""
    if importlib.util.find_spec("matplotlib") is None:
        raise PaperError(
            "matplotlib: not installed, and figures need it; run `pip install matplotlib`"
        )


def pyplot():
    import matplotlib

    matplotlib.use("Agg")
    # Text stays text, and identifiers do not change from run to run.
    matplotlib.rcParams.update(
        {
            "svg.fonttype": "none",
            "svg.hashsalt": "isomorph",
            "font.size": 9,
            "axes.grid": True,
            "grid.alpha": 0.25,
        }
    )
    import matplotlib.pyplot

    return matplotlib.pyplot


def draw(experiment: Experiment, measured: list[Measured], content: dict) -> bytes:
    """The figure as SVG; `content` is the compact form that the measurements are of."""
    painter = {"time": over_time, "sweep": sweep, "volume": volume_over_time}[experiment.figure]
    figure = painter(experiment, measured, content)
    figure.suptitle(experiment.about, fontsize=10)
    return svg(figure, bbox_inches="tight")


def svg(figure, **more: object) -> bytes:
    """A figure as SVG, closed afterwards. Places are kept to a hundredth of a point."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, **more)
    pyplot().close(figure)
    return slim(buffer.getvalue())


def slim(text: bytes) -> bytes:
    """An SVG without indentation, with two decimals in its places, and all of its words."""
    shorter = lambda found: re.sub(rb"(\.\d\d)\d+", rb"\1", found.group())
    flat = re.sub(rb"(?m)^ +", b"", text)
    return re.sub(rb'\b(?:d|x|y|cx|cy|points)="[^"]*"', shorter, flat)


def style(at: int) -> dict:
    """The look of the at-th line."""
    return {
        "color": COLOURS[at % len(COLOURS)],
        "marker": MARKERS[at % len(MARKERS)],
        "markersize": 3.5,
        # The ninth line has the first one's colour, but not its stroke.
        "linestyle": "-" if at < len(COLOURS) else "-.",
        "linewidth": 1.4,
    }


def panels(rows: int, columns: int, **more: object):
    """A figure and its (rows, columns) axes, with room for a legend beside them."""
    size = (4.0 * columns + 1.6, 3.1 * rows)
    return pyplot().subplots(
        rows, columns, figsize=size, squeeze=False, layout="constrained", **more
    )


def panel_of_each(groups: dict, **more: object):
    """A figure with a panel for each of the groups, three beside each other, the rest blank."""
    columns = min(3, len(groups))
    figure, axes = panels(-(-len(groups) // columns), columns, **more)
    for panel in axes.flat[len(groups) :]:
        panel.set_axis_off()
    return figure, axes


def legend(figure, axes) -> None:
    """One legend beside the panels for the lines of all of them."""
    entries = {}
    for panel in axes.flat:
        handles, labels = panel.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside right center", fontsize=8)


def shape_of(frame: dict) -> dict | None:
    """The surface of a method, or the carried mesh of one that has none."""
    return frame.get("surface") or frame.get("carried")


def per_pair(measured: list[Measured]) -> dict[tuple[str, tuple[int, int]], list[Measured]]:
    found: dict[tuple[str, tuple[int, int]], list[Measured]] = {}
    for one in measured:
        found.setdefault((one.sequence, one.pair), []).append(one)
    return found


def over_time(experiment: Experiment, measured: list[Measured], _):
    """The error of each frame: a panel for each pair, a line for each row."""
    groups = per_pair(measured)
    looks = {row: style(at) for at, row in enumerate(dict.fromkeys(one.row for one in measured))}
    figure, axes = panel_of_each(groups, sharey=True)
    for panel, ((sequence, (first, last)), mine) in zip(axes.flat, groups.items(), strict=False):
        for one in mine:
            frames = [(f["time"], shape_of(f)) for f in one.frames if shape_of(f)]
            errors = [1e3 * found["chamfer_squared"] for _, found in frames]
            panel.plot([time for time, _ in frames], errors, label=one.row.label, **looks[one.row])
        frames = mine[0].frames
        times = [frame["time"] for frame in frames]
        for name, dashes, label in (("linear", "--", "straight lines"), ("floor", ":", "floor")):
            errors = [1e3 * frame[name]["chamfer_squared"] for frame in frames]
            panel.plot(times, errors, dashes, color=GREY, label=label)
        title = f"{sequence}, {first}-{last}"
        panel.set(yscale="log", xlabel="time", xlim=(0, 1), title=title)
    for panel in axes[:, 0]:
        panel.set_ylabel(CD)
    legend(figure, axes)
    return figure


SWEPT = (("surface", "chamfer_squared", 1e3, CD), ("carried", "tracked_rmse", 1.0, "tracked RMSE"))


def sweep(experiment: Experiment, measured: list[Measured], _):
    """Error against what is varied: the surface's and the tracked one, a line for each family."""
    groups = by_sequence(measured)
    figure, axes = panels(len(groups), len(SWEPT))
    for across, (sequence, mine) in zip(axes, groups.items(), strict=True):
        for panel, (kind, key, factor, title) in zip(across, SWEPT, strict=True):
            for at, family in enumerate(dict.fromkeys(one.row.family for one in mine)):
                relatives = [one for one in mine if one.row.family == family]
                points = swept(relatives, kind, key)
                panel.plot(
                    [place for place, _ in points],
                    [factor * value for _, value in points],
                    label=family,
                    **style(at),
                )
            straight = mine[0].mean["linear"].get(key)
            if straight is not None:
                label = "straight lines (all true pairs)"
                panel.axhline(factor * straight, ls="--", color=GREY, label=label)
            panel.set(xlabel=experiment.axis, ylabel=title, title=sequence)
            panel.set_ylim(bottom=0)
            if experiment.logarithmic:
                panel.set_xscale("log")
                panel.minorticks_off()
            ticks = sorted({one.row.at for one in mine})
            panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    legend(figure, axes)
    return figure


def swept(measured: list[Measured], kind: str, key: str) -> list[tuple[float, float]]:
    """(place on the axis, mean over the pairs), in order, of the places that have the number."""
    places: dict[float, list[float | None]] = {}
    for one in measured:
        places.setdefault(one.row.at, []).append((one.mean.get(kind) or {}).get(key))
    means = [(place, mean_of(values)) for place, values in sorted(places.items())]
    return [(place, mean) for place, mean in means if mean is not None]


def volume_over_time(experiment: Experiment, measured: list[Measured], content: dict):
    """The enclosed volume by the source's: what the truth does, and each row."""
    truths = {(each["sequence"], each["from"], each["to"]): each for each in content["pairs"]}
    groups = per_pair(measured)
    looks = {row: style(at) for at, row in enumerate(dict.fromkeys(one.row for one in measured))}
    figure, axes = panel_of_each(groups)
    for panel, ((sequence, (first, last)), mine) in zip(axes.flat, groups.items(), strict=False):
        volumes = truths[sequence, first, last]["volume"]
        true = dict(zip(range(first, last + 1), volumes, strict=True))
        times = [(frame - first) / (last - first) for frame in true]
        panel.plot(times, true.values(), "--", color=GREY, label="truth")
        for one in mine:
            frames = [(f["time"], f["frame"], shape_of(f)) for f in one.frames if shape_of(f)]
            volumes = [found["volume_ratio"] * true[frame] for _, frame, found in frames]
            panel.plot(
                [time for time, *_ in frames], volumes, label=one.row.label, **looks[one.row]
            )
        panel.set(xlabel="time", title=f"{sequence}, {first}-{last}")
    for panel in axes[:, 0]:
        panel.set_ylabel("volume by the source's")
    legend(figure, axes)
    return figure
