"""Progress: a bar of tqdm where that is installed, and the events for whoever listens."""

from __future__ import annotations

import json
import sys
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from typing import Callable, Iterator


@contextmanager
def listener(
    on_event: Callable[[dict], object] | None,
    progress: bool | None,
    also: Callable[[dict], object] | None = None,
    jobs: int | None = None,
) -> Iterator[Callable[[str], None] | None]:
    """What the native part calls with each event, as JSON. progress: None shows a bar where nobody listens, tqdm is
    installed and somebody looks. also: a listener of this package, which leaves that as it is.
    jobs: how many, where the bar is that of a batch."""
    if progress is None:
        progress = on_event is None and watched() and find_spec("tqdm") is not None
    bar = None
    if progress:
        from tqdm.auto import tqdm

        bar = tqdm(total=jobs, unit="step" if jobs is None else "run", leave=False)
    # A bar without a length has no truth of its own.
    moved = None if bar is None else partial(follow, bar)
    listeners = [each for each in (also, on_event, moved) if each is not None]
    if not listeners:
        # Without a listener nothing is encoded; Ctrl-C is seen all the same.
        yield None
        return

    def heard(text: str) -> None:
        event = json.loads(text)
        for each in listeners:
            each(event)

    try:
        yield heard
    finally:
        if bar is not None:
            bar.close()


def follow(bar, event: dict) -> None:
    """Moves the bar."""
    kind = event["event"]
    if kind == "started":
        bar.reset(event["steps"])
        bar.update(event["first_step"])
    elif kind == "tick":
        bar.update(event["step"] - bar.n)
    elif kind == "step" and event.get("total") is not None:
        bar.set_postfix(objective=f"{event['total']:.3g}")
    elif kind == "extracting":
        bar.reset(event["frames"])
        bar.set_description("surfaces")
    elif kind == "extracted":
        bar.update(1)
    elif kind.startswith("job_"):
        bar.update(event["done"] + event["failed"] - bar.n)
        if event["failed"]:
            bar.set_postfix(failed=event["failed"])


def watched() -> bool:
    """Whether somebody looks: a terminal, or a notebook."""
    return sys.stderr.isatty() or in_notebook()


def in_notebook() -> bool:
    try:
        return get_ipython().has_trait("kernel")  # type: ignore[name-defined]
    except (NameError, AttributeError):
        return False
