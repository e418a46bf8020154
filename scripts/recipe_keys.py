"""Which keys a recipe has, for the tests of the scripts: read from the program's source.

`declared` finds them where the sections are declared. `idle` names those of a row that act on
nothing in its method and geometry, which `isomorph compare` refuses.
"""

import re
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src"

# Presets and the geometry that each of them has; all other methods are those compared with.
GEOMETRIES = {"quick": "flow", "default": "flow", "quality": "flow", "paper": "network"}
NETWORK_ONLY = ("level-set", "level-set-form", "lambda-l", "transported-normals")
FLOW_ONLY = ("distance",)
BASELINES = ("mlp", "sdf-blend", "lipmlp", "nise", "nise-velocity", "eigenbasis", "nfgp", "efis")
# What these fit to their shapes; all other terms are of a method with a velocity field.
BASELINE_LOSSES = ("data", "normals", "eikonal", "off-surface", "distance")
MOVING = ("eigenbasis", "nfgp")


def declared() -> set[str]:
    """All keys as `section.key`, from the files that declare the sections of a recipe."""
    found = set()
    for path in [*SOURCE.rglob("recipe/*.rs"), *SOURCE.rglob("method/*.rs")]:
        section = None
        for line in path.read_text("utf-8").splitlines():
            opened = re.match(r"\s*(?:pub )?(\w+): \w+(?:Recipe|Keys) \{", line)
            key = re.match(r"\s+(\w+): [^=]+=(?!=)", line)
            if opened:
                section = opened.group(1).replace("_", "-")
            elif section and key:
                found.add(f"{section}.{key.group(1).replace('_', '-')}")
    return found


def idle(method: str, keys: list[str]) -> list[str]:
    """Those of a row's keys, `section.key=value`, that act on nothing in it."""
    given = dict(key.split("=", 1) for key in keys)
    geometry = given.get("implicit.geometry", GEOMETRIES.get(method))
    return [key for key in given if acts_not(key, method, geometry)]


def acts_not(key: str, method: str, geometry: str | None) -> bool:
    section, field = key.split(".")
    if method in BASELINES:
        loss = section == "loss" and field not in BASELINE_LOSSES
        return loss or (section == "velocity" and method not in MOVING)
    others = NETWORK_ONLY if geometry == "flow" else FLOW_ONLY
    return section == "loss" and field in others
