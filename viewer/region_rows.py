"""The numbers of regions and of the boundaries between them, column by column."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from bake.region_types import PARAMETERS, CentreKind, Regions
from viewer.fields import distance_label
from viewer.instance_rows import Column
from viewer.region_values import CENTRE_WORDS, POINTS, term_counts, used_models, valid_counts
from viewer.region_view import RegionView

_UNKNOWN = -1.0  # sorts below every error


def region_columns(
    regions: Regions, view: RegionView, distances: Sequence[float], region_bytes: np.ndarray
) -> list[Column]:
    """A row a region, in the graph's order.

    Args:
        regions: What was baked.
        view: Says whether errors are those of the fitted or of the regularised models.
        distances: The k distances, metres.
        region_bytes: Shape (r,): memory that each region takes in the engine.
    """
    graph, fitted, used = regions.graph, regions.fitted, used_models(regions, view)
    state = "as fitted" if view.as_fitted else "regularised"
    size = graph.maximum - graph.minimum
    valid, terms = valid_counts(regions), term_counts(fitted)
    kinds = [CentreKind(int(kind)) for kind in np.asarray(fitted.centre_kind)]
    columns = [
        Column("Region", graph.names, graph.names, "Name of the region"),
        Column(
            "Size m",
            Formatted(np.arange(len(size)), lambda row: " × ".join(f"{edge:.3g}" for edge in size[int(row)])),
            np.prod(size, axis=1).tolist(),
            "Edges of its box along x, y and z; sorted by volume",
        ),
        Column(
            "Valid",
            Formatted(valid, lambda count: f"{count:.0f} / {POINTS}"),
            valid.tolist(),
            "Grid points that are reachable and do not see too many back faces",
        ),
    ]
    for column, distance in enumerate(distances):
        label = distance_label(distance)
        columns.append(
            _numbers(
                f"RMSE {label}",
                np.asarray(used.rmse)[:, column],
                f"Error of the model ({state}) at the region's valid points, at {label}, over six directions",
            )
        )
    taken = _taken(regions)
    return [
        *columns,
        Column("Centre", [CENTRE_WORDS[kind] for kind in kinds], [int(kind) for kind in kinds], "Centre of its model"),
        Column(
            "Terms",
            Formatted(terms, lambda count: f"{count:.0f} / {PARAMETERS}"),
            terms.tolist(),
            "Parameters that its points determined: the mean and six one-sided derivatives",
        ),
        Column(
            "Bytes",
            Formatted(region_bytes, "{:,.0f}".format),
            region_bytes.tolist(),
            "Memory of the model in the engine's packed form",
        ),
        Column(
            "Absorbed",
            [text for text, _ in taken],
            [order for _, order in taken],
            "Whose model a very small region uses, or which regions use this one's; with the RMSE that it costs",
        ),
    ]


def boundary_columns(regions: Regions, distances: Sequence[float]) -> list[Column]:
    """A row a boundary, in the graph's order."""
    graph = regions.graph
    names = [[graph.names[region] for region in side] for side in graph.link.T]
    columns = [
        Column("Region", names[0], names[0], "One of the two regions"),
        Column("Neighbour", names[1], names[1], "The other one"),
        Column(
            "Area m²",
            Formatted(graph.link_area, "{:.3g}".format),
            graph.link_area.tolist(),
            "How much boundary the two share; it weighs their agreement",
        ),
    ]
    for column, distance in enumerate(distances):
        before = np.asarray(regions.mismatch_before)[:, column]
        after = np.asarray(regions.mismatch_after)[:, column]
        label = distance_label(distance)
        columns.append(
            _numbers(
                f"Before {label}", before, f"Mismatch of the fitted models at {label}: AO, worst of six directions"
            )
        )
        columns.append(
            _numbers(
                f"After {label}", after, f"Mismatch of the regularised models at {label}: AO, worst of six directions"
            )
        )
    return columns


def _taken(regions: Regions) -> list[tuple[str, int]]:
    """What each region has to do with absorption, and how it is sorted."""
    names = regions.graph.names
    into = {gone: (owner, float(error.max())) for (gone, owner), error in zip(
        regions.absorbed, np.asarray(regions.absorbed_error), strict=True
    )}  # fmt: skip
    takes: dict[str, list[str]] = {}
    for gone, owner in regions.absorbed:
        takes.setdefault(owner, []).append(gone)
    rows: list[tuple[str, int]] = []
    for name in names:
        if name in into:
            owner, error = into[name]
            rows.append((f"in {owner}, costs {_number(error)}", 2))
        else:
            rows.append((f"takes {', '.join(takes[name])}", 1) if name in takes else ("", 0))
    return rows


@dataclass(frozen=True, slots=True)
class Formatted(Sequence[str]):
    """Numbers as texts, each made when it is looked at: of thousands of rows only some are in view.

    Attributes:
        values: The numbers.
        text: Makes a text of one.
    """

    values: np.ndarray
    text: Callable[[float], str]

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> Formatted: ...

    def __getitem__(self, index: int | slice) -> str | Formatted:
        if isinstance(index, slice):
            return Formatted(self.values[index], self.text)
        return self.text(float(self.values[index]))


def _numbers(heading: str, values: np.ndarray, tip: str) -> Column:
    keys = np.where(np.isnan(values), _UNKNOWN, values)
    return Column(heading, Formatted(values, _number), keys.tolist(), tip)


def _number(value: float) -> str:
    return "–" if np.isnan(value) else f"{value:.4f}"
