"""Regions as a file or a side file states them, checked against the world that they are for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bake.errors import SceneError
from bake.region_types import GRID
from bake.regions.boundaries import Openings
from bake.regions.links import meeting_pairs
from bake.regions.region_document import FileLink, FileRegion, RegionFile
from bake.types import BoolArray, Finding, Float64Array, Int32Array, World

THINNEST = 64.0 * 2.0**-24
"""Thinnest box edge in units of its farthest coordinate: grid points are float32, and eight must differ."""


@dataclass(frozen=True, slots=True)
class StatedBoxes:
    """Boxes in the world's own coordinates.

    Attributes:
        names: r unique names.
        minimum, maximum: Shape (r, 3), metres relative to `World.origin`.
        seed: Shape (r, 3); NaN where none is stated.
        bits: Shape (r, GRID³), bool: stated validity, and `has_bits`, shape (r,), where there is any.
    """

    names: tuple[str, ...]
    minimum: Float64Array
    maximum: Float64Array
    seed: Float64Array
    bits: BoolArray
    has_bits: BoolArray


def boxes_in_world(stated: RegionFile, world: World) -> tuple[StatedBoxes, list[Finding]]:
    """The regions that can be used; those far outside the scene are set aside, and a finding names each.

    Raises:
        SceneError: one is too thin for its place, or none lies near the scene.
    """
    used = world.positions[np.unique(world.faces[world.face_casts])] if world.face_casts.any() else world.positions
    low, high = used.min(axis=0), used.max(axis=0)
    margin = 0.5 * float(np.linalg.norm(high - low))
    kept: list[FileRegion] = []
    findings: list[Finding] = []
    for region in stated.regions:
        first, last = np.array(region.minimum) - world.origin, np.array(region.maximum) - world.origin
        thinnest = float((last - first).min())
        if not thinnest > THINNEST * float(np.abs([first, last]).max()):
            raise SceneError(
                f"region {region.name[:60]!r} is {thinnest:.3g} m thin, less than can be told apart there",
                where=stated.where,
                remedy="make it thicker",
            )
        if (last < low - margin).any() or (first > high + margin).any():
            detail = f"region {region.name[:60]!r} lies far outside the scene; it is left out with its links"
            findings.append(Finding(stated.where, "region-outside-scene", 1, detail, "set-aside"))
        else:
            kept.append(region)
    if stated.regions and not kept:
        raise SceneError(
            f"all {len(stated.regions):,} regions lie far outside the scene",
            where=stated.where,
            remedy="state boxes in metres, in the scene's world coordinates",
        )
    unsaid = (np.nan, np.nan, np.nan)
    bits = np.array([np.zeros(GRID**3) if region.valid is None else region.valid for region in kept], np.bool_)
    return StatedBoxes(
        tuple(region.name for region in kept),
        _points([region.minimum for region in kept], world),
        _points([region.maximum for region in kept], world),
        _points([region.seed or unsaid for region in kept], world),
        bits.reshape(-1, GRID**3),
        np.array([region.valid is not None for region in kept], np.bool_),
    ), findings


@dataclass(frozen=True, slots=True)
class StatedLinks:
    """Pairs of regions that may be linked, and what is stated of them.

    Attributes:
        pairs: Shape (l, 2), int32, a < b.
        area: Shape (l,); NaN where it is to be measured.
        centre: Shape (l, 3), relative to `World.origin`; NaN where it is to be measured.
        links: As stated; empty where pairs come from boxes that meet.
    """

    pairs: Int32Array
    area: Float64Array
    centre: Float64Array
    links: tuple[FileLink, ...]


def links_between(stated: RegionFile, boxes: StatedBoxes, world: World) -> StatedLinks:
    """The links that a file states between usable regions; without `links` in it, the pairs of boxes that meet."""
    if stated.links is None:
        pairs = meeting_pairs(boxes.minimum, boxes.maximum)
        return StatedLinks(pairs, np.full(len(pairs), np.nan), np.full((len(pairs), 3), np.nan), ())
    row = {name: number for number, name in enumerate(boxes.names)}
    links = [link for link in stated.links if link.a in row and link.b in row]
    links.sort(key=lambda link: sorted((row[link.a], row[link.b])))
    unsaid = (np.nan, np.nan, np.nan)
    return StatedLinks(
        np.array([sorted((row[link.a], row[link.b])) for link in links], np.int32).reshape(-1, 2),
        np.array([np.nan if link.area is None else link.area for link in links], np.float64),
        _points([link.centre or unsaid for link in links], world),
        tuple(links),
    )


def open_links(
    stated: RegionFile, links: StatedLinks, openings: Openings
) -> tuple[Int32Array, Float64Array, Float64Array, list[Finding]]:
    """Pairs, areas and centres of the links that hold: what is stated wins over what was measured.

    A stated link is left out where something of it had to be measured and nothing is open; a finding names it.
    """
    area = np.where(np.isnan(links.area), openings.area, links.area)
    centre = np.where(np.isnan(links.centre), openings.centre, links.centre)
    good = (area > 0.0) & np.isfinite(centre).all(axis=1)
    findings: list[Finding] = []
    for number in np.flatnonzero(~good).tolist() if links.links else ():
        link = links.links[number]
        detail = (
            f"nothing is open between {link.a[:60]!r} and {link.b[:60]!r}; the link is left out, unless it has an "
            "area and a centre"
        )
        findings.append(Finding(stated.where, "closed-link", 1, detail))
    return links.pairs[good], area[good], centre[good], findings


def _points(values: list[tuple[float, float, float]], world: World) -> Float64Array:
    return np.array(values, np.float64).reshape(-1, 3) - world.origin
