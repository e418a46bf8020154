"""The table of an experiment, as Markdown.

All numbers are means over the frames strictly between the ends, then over the pairs of a sequence,
in normalised units (joint bounding box centred, mean area 1): DESIGN, section 4.
"""

from collections.abc import Callable
from dataclasses import dataclass

from . import record
from .runs import Measured


@dataclass(frozen=True)
class Column:
    """One number of a table."""

    key: str
    title: str
    of: Callable[[dict], float | None]
    factor: float = 1.0
    digits: int = 3
    best: Callable[[float], float] | None = None
    """What is least for the best value; None where there is no contest."""


def entry(*path: str) -> Callable[[dict], float | None]:
    """The number at a path of the mean, or None if the method has none."""

    def look(mean: dict) -> float | None:
        value = mean
        for name in path:
            value = None if value is None else value.get(name)
        return value

    return look


def least(value: float) -> float:
    return value


def surface_columns(kind: str) -> tuple[Column, ...]:
    """The columns of a surface: of the methods, the straight lines or the floor."""

    def column(key, title, *path, factor=1.0, digits=3, best=least):
        return Column(key, title, entry(kind, *path), factor, digits, best)

    cd, hd = "chamfer_squared", "hausdorff"
    return (
        column(cd, "CD x10^3", cd, factor=1e3),
        column(hd, "HD", hd),
        column("hausdorff_squared", "HD^2 x10^2", "hausdorff_squared", factor=1e2),
        column(f"aligned_{cd}", "CD x10^3 aligned", "aligned", cd, factor=1e3),
        column(f"aligned_{hd}", "HD aligned", "aligned", hd),
        column("normal_consistency", "normals", "normal_consistency", best=lambda share: -share),
        column("volume_ratio", "volume", "volume_ratio", best=lambda ratio: abs(ratio - 1)),
        column("components", "pieces", "components", digits=1, best=None),
    )


def carried_columns(kind: str) -> tuple[Column, ...]:
    """The columns of a mesh that is carried along: of the methods or the straight lines."""

    def column(key, title, *path, factor=1.0, digits=4):
        return Column(key, title, entry(kind, *path), factor, digits, least)

    cd, tracked = "chamfer_squared", "tracked_rmse"
    return (
        column(f"carried_{cd}", "carried CD x10^3", cd, factor=1e3, digits=3),
        column(tracked, "tracked RMSE", tracked),
        column(f"aligned_{tracked}", "tracked RMSE aligned", "aligned", tracked),
    )


COLUMNS = (*surface_columns("surface"), *carried_columns("carried"))
# The straight lines move vertices, but stand where the methods have their surface too.
LINEAR = (*surface_columns("linear"), *carried_columns("linear"))
STRAIGHT = "straight lines (all true pairs)"
FLOOR = surface_columns("floor")


@dataclass(frozen=True)
class Line:
    """A line of a table: a label, how many pairs it is the mean of, its values by column key."""

    label: str
    pairs: int
    values: dict[str, float | None]
    seconds: float | None = None
    contends: bool = True


def mean_of(values: list[float | None]) -> float | None:
    """The mean, or None where one is missing."""
    if not values or any(value is None for value in values):
        return None
    return sum(values) / len(values)


def line(label: str, measured: list[Measured], columns: tuple[Column, ...], **more: object) -> Line:
    values = {column.key: mean_of([column.of(one.mean) for one in measured]) for column in columns}
    return Line(label, len({one.pair for one in measured}), values, **more)


def lines_of(measured: list[Measured]) -> list[Line]:
    """The lines of one sequence: its rows, then straight lines and the floor."""
    rows = dict.fromkeys(one.row for one in measured)
    lines = []
    for row in rows:
        mine = [one for one in measured if one.row == row]
        seconds = mean_of([one.entry.get("training_seconds") for one in mine])
        lines.append(line(row.label, mine, COLUMNS, seconds=seconds))
    # Every entry of a pair has the same reference rows, so one per pair is the mean's weight.
    once = list({one.pair: one for one in measured}.values())
    lines.append(line(STRAIGHT, once, LINEAR, contends=False))
    lines.append(line("floor (two samplings of the truth)", once, FLOOR, contends=False))
    return lines


def cell(column: Column, each: Line, best: float | None, most: int) -> str:
    """A number: bold if it is the best of the rows, (!) if straight lines beat them all."""
    value = each.values.get(column.key)
    if value is None:
        return "-"
    shown = f"{value * column.factor:.{column.digits}f}"
    if best is None or each.pairs < most:
        return shown
    if each.contends:
        return f"**{shown}**" if value == best else shown
    beats = each.label == STRAIGHT and column.best(value) < column.best(best)
    return f"{shown} (!)" if beats else shown


def best_of(column: Column, lines: list[Line]) -> float | None:
    """The best value among the lines that were run on all pairs."""
    most = max(each.pairs for each in lines)
    values = [
        each.values[column.key]
        for each in lines
        if each.contends and each.pairs == most and each.values.get(column.key) is not None
    ]
    if column.best is None or len(values) < 2:
        return None
    return min(values, key=column.best)


def table(lines: list[Line]) -> str:
    """A Markdown table whose columns are aligned in the source too."""
    shown = [c for c in COLUMNS if any(each.values.get(c.key) is not None for each in lines)]
    rows = [["row", *(column.title for column in shown), "training s"]]
    best = {column.key: best_of(column, lines) for column in shown}
    most = max(each.pairs for each in lines)
    for each in lines:
        label = each.label if each.pairs == most else f"{each.label} ({each.pairs} of {most} pairs)"
        cells = [label, *(cell(column, each, best[column.key], most) for column in shown)]
        rows.append([*cells, "-" if each.seconds is None else f"{each.seconds:.0f}"])
    widths = [max(len(row[at]) for row in rows) for at in range(len(rows[0]))]
    rules = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    padded = lambda row: [
        row[0].ljust(widths[0]),
        *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True)),
    ]
    return "\n".join(f"| {' | '.join(padded(row))} |" for row in [rows[0], rules, *rows[1:]])


CAPTION = """\
Means over the frames in between and the pairs, in normalised units (area 1). CD: sum of both
directions' mean squared distance. HD: the greater of the two greatest distances. Aligned: at the
best times in order. Normals: consistency. Volume: over the true one. Carried: the source's mesh.
Training: seconds of one pair. Bold: the best of the rows that ran on all pairs. Straight lines use
all true correspondences, which no row does; (!) where they beat every row all the same."""


def by_sequence(measured: list[Measured]) -> dict[str, list[Measured]]:
    found: dict[str, list[Measured]] = {}
    for one in measured:
        found.setdefault(one.sequence, []).append(one)
    return found


def sections(measured: list[Measured]) -> list[str]:
    """For each sequence its table; where it has several pairs, one for each of them too."""
    parts = []
    for sequence, mine in by_sequence(measured).items():
        pairs = list(dict.fromkeys(one.pair for one in mine))
        shown = ", ".join(f"{first}-{last}" for first, last in pairs)
        parts += [f"## {sequence}, frames {shown}", table(lines_of(mine))]
        for pair in pairs if len(pairs) > 1 else ():
            only = [one for one in mine if one.pair == pair]
            parts += [f"### {sequence}, frames {pair[0]}-{pair[1]}", table(lines_of(only))]
    return parts


def markdown(name: str, content: dict, measured: list[Measured]) -> str:
    """The whole of table.md, from the compact form and the rows of its results."""
    parts = [f"# {name}", content["about"], *sections(measured), CAPTION]
    parts += content.get("notes", [])
    settings = content.get("settings")
    if settings:
        steps, batch = settings["steps"], settings["batch"]
        had = "the steps and points of their presets"
        if steps is not None:
            had = f"{steps:,} steps of {batch:,} points"
        parts.append(f"Rows had {had}, seed {settings['seed']}. {record.made_by(content)}")
    else:
        parts += made_by_compare(content, measured)
    return "\n\n".join(parts) + "\n"


def made_by_compare(content: dict, measured: list[Measured]) -> list[str]:
    """How rows were made that have no settings in common: each on its own, then the commands."""
    lines = ["| row | steps | points | seed | version | cores | processor | date |"]
    lines.append("| --- | ---: | ---: | ---: | --- | ---: | --- | --- |")
    for one in measured:
        has = lambda key, of=one.entry: "-" if of.get(key) is None else of[key]
        machine = one.entry.get("machine") or {}
        cells = [one.row.label, has("steps"), has("batch"), has("seed"), has("isomorph")]
        cells += [has("cores", machine), has("cpu", machine), str(has("date"))[:10]]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    # A row that was made in the same way on each of its pairs is said once.
    rows = "\n".join(dict.fromkeys(lines))
    return [rows, "Made by", "```text\n" + "\n".join(content["commands"]) + "\n```"]
