"""Tables of how far rebakes are from whole bakes, and the gates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bake.bench.rebake_edits import KINDS
from bake.bench.table import Measurements

LARGEST, RMS = 2.0 / 255.0, 1e-3
"""Gates at the default bound: largest difference and root mean square, over each kind of values."""

EXACT = 1e-5
"""Gate with the bound at 0."""

COMPARED = ("vertices", "voxels", "trees", "shrub_scalars", "small_scalars", "points", "regions")

Rows = Sequence[Mapping[str, Any]]


def gates(bound: float) -> tuple[float, float]:
    """Largest difference and root mean square that a rebake with this bound may have."""
    return (LARGEST, RMS) if bound > 0.0 else (EXACT, EXACT)


def rebake_tables(rows: Rows, *, edits: int, bound: float, seeds: Sequence[int]) -> list[Measurements]:
    """The distribution of the differences over the edits, by kind of values and by kind of edit.

    Args:
        rows: One an edit, see `bake.bench.rebake.edit_rows`.
        edits: That were asked for.
        bound, seeds: Of the run.
    """
    limit, rms_limit = gates(bound)
    notes = [
        f"{len(rows)} of {edits} edits of seed {', '.join(map(str, seeds))}, bound {bound:.5f}; after each the scene "
        "was baked whole, with the same seeds",
        f"gates: no value off by more than {limit:.2g}, root mean square at most {rms_limit:.2g}, after every edit",
    ]
    named = {f"edits {number}": seed for number, seed in enumerate(seeds, 1)}
    after = [
        "largest and rms: over all kinds of values. A rebake takes over what the edits before it left out, so that "
        "these are differences after an edit of that kind, not by it",
    ]
    return [
        Measurements("rebake: differences", _by_values(rows, limit, rms_limit), notes, seeds=named),
        Measurements("rebake: kinds of edits", _by_kind(rows), after, seeds=named),
    ]


def _by_values(rows: Rows, limit: float, rms_limit: float) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for name in COMPARED:
            errors = [row["errors"][name] for row in rows if row["scene"] == scene and name in row["errors"]]
            if not errors:
                continue
            largest = np.array([error["largest"] for error in errors])
            rms = np.array([error["rms"] for error in errors])
            found.append(
                {
                    "scene": scene,
                    "values": name,
                    "edits": len(errors),
                    "equal": int(np.count_nonzero(largest == 0.0)),
                    **{f"largest_{share}": float(np.quantile(largest, share / 100.0)) for share in (50, 90, 99)},
                    "largest": float(largest.max()),
                    **{f"rms_{share}": float(np.quantile(rms, share / 100.0)) for share in (50, 90, 99)},
                    "rms": float(rms.max()),
                    "passed": bool(largest.max() <= limit and rms.max() <= rms_limit),
                }
            )
    return found


def _by_kind(rows: Rows) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for kind in KINDS:
            own = [row for row in rows if row["scene"] == scene and row["kind"] == kind]
            if not own:
                continue
            part = [row for row in own if not row["full"]]
            changed = sum(row["rays_changed"] for row in part)
            errors = [error for row in own for error in row["errors"].values()]
            found.append(
                {
                    "scene": scene,
                    "kind": kind,
                    "edits": len(own),
                    "in_full": len(own) - len(part),
                    "largest": max(error["largest"] for error in errors),
                    "rms": max(error["rms"] for error in errors),
                    "rebake_s": float(np.median([row["seconds"] for row in own])),
                    "whole_s": float(np.median([row["whole_seconds"] for row in own])),
                    "samples_checked": int(np.median([row["samples_checked"] + row["samples_whole"] for row in own])),
                    "rays_traced": int(np.median([row["rays_traced"] for row in own])),
                    "traced_per_changed": sum(row["rays_traced"] for row in part) / changed if changed else None,
                }
            )
    return found
