"""Causes that lie in how samples became the value: what can be seen from the spot is lighter than what was baked.

Each test measures how much of that gap its cause explains.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bake.explain.cause_names import CauseKind
from bake.explain.cause_types import Cause, Remedy, certainty, darker, percent
from bake.explain.evidence import Evidence
from bake.explain.suspect import Suspect
from bake.geometry import cosine_direction, face_normals
from bake.low_discrepancy import owen_sobol
from bake.types import BoolArray, Float64Array

GAP = 0.08
"""AO by which a value must be darker than what can be seen before the mapping is blamed."""

BURIED = 0.5
"""Share of hits from behind above which a sample lies inside something."""

SEAM_REACH = 1e-3
"""Metres within which vertices should agree."""

RETRACED_RAYS = 64

NEARBY = 0.1
"""Share of the distance within which samples tell of the spot itself: AO changes over such lengths."""

FAR_AT_MOST = 0.6
"""Confidence in a lack of samples if it shows in nothing but their distance: other causes look alike."""


def gap_counts(evidence: Evidence) -> float:
    """How far a value is too dark to be chance, in [0, 1]."""
    return darker(evidence.value, evidence.seen, GAP)


def starved(suspect: Suspect) -> Cause | None:
    """The value comes from elsewhere, because hardly a valid sample lies around the spot."""
    evidence = suspect.evidence
    if evidence.unseen:
        return None
    near, blind = near_weight(suspect), blind_weight(suspect)
    lacking = max(
        certainty(evidence.own_weight, 0.6, 0.2),
        certainty(evidence.invalid_share, 0.6, 0.9),
        certainty(blind, 0.5, 0.8),
        FAR_AT_MOST * certainty(near, 0.4, 0.1),
    )
    strength = lacking * max(gap_counts(evidence), certainty(-evidence.gap, 0.5 * GAP, 1.5 * GAP))
    if strength <= 0.0:
        return None
    carried = max(1.0 - evidence.own_weight, 0.0)
    text = (
        f"{evidence.valid} of {evidence.valid + evidence.invalid} samples on the faces around are valid; "
        f"{percent(carried)} of the value comes from other faces, {percent(near)} from samples within "
        f"{100.0 * NEARBY * evidence.distance:.3g} cm, {percent(blind)} from such that something hides from the spot. "
        f"Seen from the spot itself, AO is {evidence.seen:.2f} instead of {evidence.value:.2f}."
    )
    more = min(4096, max(256, 8 * (evidence.valid + evidence.invalid) // max(len(evidence.faces), 1), 1024))
    remedies = (
        Remedy("samples", f"Place {more} samples on each of its faces.", {suspect.path: {"samples": more}}),
        Remedy("model", "Split the faces where they go into the other surface."),
    )
    numbers = {
        "valid": evidence.valid,
        "invalid": evidence.invalid,
        "own_weight": evidence.own_weight,
        "near_weight": near,
        "hidden_weight": blind,
        "gap": evidence.gap,
    }
    return Cause(CauseKind.STARVED, strength, text, numbers, remedies, suspect.object)


def blind_weight(suspect: Suspect) -> float:
    """Share of the heavy samples' weight that lies where the spot cannot be seen from, in [0, 1]; not inside others."""
    heavy = suspect.evidence.heavy
    weight = np.abs(heavy.weight)
    hidden = heavy.hidden & ~inside_others(suspect)
    return float(weight[hidden].sum() / max(weight.sum(), 1e-12))


def near_weight(suspect: Suspect) -> float:
    """Share of the weight that samples close to the spot have, in [0, 1]."""
    samples = suspect.explanation.samples
    weight = np.abs(samples.weight)
    near = samples.distance < NEARBY * suspect.evidence.distance
    return float(weight[near].sum() / max(weight.sum(), 1e-12))


def overshoot(suspect: Suspect) -> Cause | None:
    """The fit swings below what the samples around say."""
    evidence = suspect.evidence
    below = evidence.average - evidence.value
    held = any(abs(float(item.effect[evidence.column])) > 0.02 for item in suspect.explanation.held)
    swing = max(certainty(evidence.swing, 0.05, 0.25), 0.8 if held else 0.0)
    thin = certainty(evidence.slenderness, 4.0, 12.0)
    # below the average of what lies around is right where the spot sees less than its surroundings do
    strength = gap_counts(evidence) * certainty(below, 0.02, 0.07) * swing * thin
    strength *= certainty(evidence.own_weight, 0.1, 0.4)
    if strength <= 0.0:
        return None
    text = (
        f"The samples around average {evidence.average:.2f} and the spot sees {evidence.seen:.2f}, but the fit gives "
        f"{evidence.value:.2f}; negative weights add up to {evidence.swing:.2f}. The longest edge around is "
        f"{evidence.slenderness:.0f} times as long as its triangle is high"
        f"{', and bounds hold values here' if held else ''}."
    )
    alpha = max(0.2, 5.0 * suspect.explainer.settings.alpha)
    remedies = (
        Remedy("alpha", f"Smooth this object more: alpha {alpha:g}.", {suspect.path: {"alpha": alpha}}),
        Remedy("model", "Cut the long thin triangles."),
    )
    numbers = {"below": below, "swing": evidence.swing, "slenderness": evidence.slenderness}
    return Cause(CauseKind.OVERSHOOT, strength, text, numbers, remedies, suspect.object)


def split_seam(suspect: Suspect) -> Cause | None:
    """A vertex at the same place, with a like normal, has another value."""
    surface, world, spot = suspect.explainer.mapper.surface, suspect.world, suspect.explanation.spot
    column = suspect.evidence.column
    values = suspect.explainer.adjoint.values[:, column]
    sides = _outward(suspect)
    best, other, where = 0.0, -1, -1
    for vertex, weight in zip(spot.vertices.tolist(), spot.weights.tolist(), strict=True):
        own = int(surface.unknown[vertex])
        if weight < 0.2 or own < 0:
            continue
        near = np.flatnonzero(
            (np.abs(world.positions - world.positions[vertex]) < SEAM_REACH).all(axis=1) & (surface.unknown >= 0)
        )
        near = near[surface.unknown[near] != own]
        for partner in near.tolist():
            cosine = float(sides(vertex) @ sides(partner))
            step = abs(float(values[surface.unknown[partner]] - values[own]))
            if cosine > np.cos(np.radians(suspect.explainer.settings.crease_angle)) and step > best:
                best, other, where = step, partner, vertex
    strength = certainty(best, 0.06, 0.16)
    if strength <= 0.0:
        return None
    number = int(np.searchsorted(world.first_vertex, other, side="right")) - 1
    gap = float(np.linalg.norm(world.positions[other] - world.positions[where]))
    across = world.object_paths[number]
    text = (
        f"A vertex of {across} lies {1000.0 * gap:.3g} mm away and looks the same way, but its AO is "
        f"{values[surface.unknown[other]]:.2f} instead of {values[surface.unknown[where]]:.2f}: the step is {best:.2f}."
    )
    objects = {path: {"weld": True} for path in dict.fromkeys((suspect.path, across))}
    remedies = (Remedy("weld", "Weld the objects: they share one value along the seam.", objects),)
    if gap > 1e-4:  # farther apart than the solve ever welds
        remedies = (Remedy("model", "Move the vertices together: welding reaches 0.1 mm."),)
    return Cause(CauseKind.SEAM, strength, text, {"step": best, "apart_m": gap}, remedies, number)


def below_plane(suspect: Suspect) -> Cause | None:
    """Shading normals lean so far that rays are sent below the faces and mirrored."""
    heavy = suspect.evidence.heavy
    weight = np.abs(heavy.weight)
    total = float(weight.sum())
    mirrored = float(weight @ heavy.mirrored / total) if total > 0.0 else 0.0
    if mirrored < 0.08:
        return None
    count = len(heavy.row)
    u, v = owen_sobol(
        np.tile(np.arange(RETRACED_RAYS), count), np.repeat(np.arange(count, dtype=np.uint32), RETRACED_RAYS)
    )
    ways = cosine_direction(u, v, np.repeat(heavy.face_normal, RETRACED_RAYS, axis=0)).reshape(count, -1, 3)
    origins = suspect.explanation.rays.origin[:count].astype(np.float64)
    gain = suspect.change(suspect.retraced(origins, ways))
    strength = certainty(mirrored, 0.08, 0.2) * certainty(abs(gain), 0.04, 0.12)
    if strength <= 0.0:
        return None
    lean = float(np.degrees(np.arccos(np.clip(weight @ heavy.slant / total, -1.0, 1.0))))
    text = (
        f"The normals lean {lean:.0f}° away from their faces: {percent(mirrored)} of the rays would start into the "
        f"surface and were mirrored. With rays around the faces' own normals, AO would be {gain:+.2f}."
    )
    remedies = (
        Remedy("normals", "Ignore the vertex normals; take those of the faces.", {suspect.path: {"normals": "faces"}}),
        Remedy("model", "Mend the normals in the model."),
    )
    return Cause(
        CauseKind.BELOW_PLANE,
        strength,
        text,
        {"mirrored": mirrored, "lean": lean, "gain": gain},
        remedies,
        suspect.object,
    )


def buried(suspect: Suspect) -> Cause | None:
    """Samples that lie inside something, but count as valid, pull the value down."""
    evidence, heavy = suspect.evidence, suspect.evidence.heavy
    if evidence.unseen:
        return _out_of_sight(suspect)
    inside = inside_others(suspect)
    if not inside.any():
        return None
    share = float(np.abs(heavy.weight[inside]).sum())
    rest = heavy.without(inside)
    if not np.isfinite(rest):  # nothing else weighs: then it is what can be seen that they stand in for
        rest = evidence.seen
    explained = (rest - evidence.value) / max(evidence.gap, GAP)
    strength = gap_counts(evidence) * certainty(explained, 0.2, 0.6)
    if strength <= 0.0:
        return None
    around = _surrounding(suspect, inside)
    name = suspect.world.object_paths[around] if around >= 0 else "other geometry"
    back = float(heavy.from_behind[inside].mean())
    text = (
        f"{percent(share)} of the value comes from {int(inside.sum())} samples inside {name}: "
        f"{percent(back)} of what their rays meet shows its back, yet counts, because it is two-sided. "
        f"Without them AO would be {rest:.2f} instead of {evidence.value:.2f}."
    )
    remedies: list[Remedy] = []
    if around >= 0 and suspect.world.face_two_sided[suspect.world.face_object == around].any():
        told = f"Make {name} one-sided: samples inside it are then invalid."
        remedies.append(Remedy("two-sided", told, {name: {"two_sided": False}}))
    remedies.append(Remedy("model", "Cut the faces where they go into the other object."))
    numbers = {"weight_inside": share, "from_behind": back, "explained": explained}
    return Cause(CauseKind.BURIED, strength, text, numbers, tuple(remedies), around)


def _out_of_sight(suspect: Suspect) -> Cause:
    """The spot itself lies inside or under something."""
    evidence = suspect.evidence
    backs = float(evidence.front.proof.mean())
    text = (
        f"{percent(backs)} of what the spot itself sees shows its back: it lies inside or under something, and nobody "
        f"should see it. {evidence.invalid} of {evidence.valid + evidence.invalid} samples around are invalid."
    )
    remedies = (Remedy("model", "Cut the faces where they go into the other surface, if light parts nearby suffer."),)
    numbers = {"from_behind": backs, "invalid": float(evidence.invalid)}
    return Cause(CauseKind.BURIED, certainty(backs, 0.4, 0.7), text, numbers, remedies, suspect.object)


def inside_others(suspect: Suspect) -> BoolArray:
    """Heavy samples that see next to nothing but backs, and darkness, shape (h,)."""
    evidence, heavy = suspect.evidence, suspect.evidence.heavy
    sees_backs = (heavy.from_behind > BURIED) & (heavy.stopped > 0.9) & (heavy.covered < 0.3)
    # where the spot itself sees backs, as in levels of arbitrary winding, backs tell less
    usual = float((evidence.front.from_behind * evidence.front.stopped).mean()) if evidence.seen > 0.2 else 0.0
    darker = heavy.ao < evidence.seen - 0.15
    more = heavy.from_behind * heavy.stopped - usual
    return sees_backs & darker & ((more > 0.3) | (heavy.hidden & (more > 0.1)))


def leak(suspect: Suspect) -> Cause | None:
    """Samples that cannot be seen from the spot, behind a wall or under something, bring their darkness."""
    evidence, heavy = suspect.evidence, suspect.evidence.heavy
    level = heavy.face_normal @ suspect.explanation.spot.normal > 0.5
    if evidence.unseen:
        return None
    hidden = heavy.hidden & level & ~inside_others(suspect) & (heavy.ao < evidence.seen - 0.1)
    rest = heavy.without(hidden)
    if not hidden.any() or not np.isfinite(rest):  # nothing else weighs: then it is samples that are lacking
        return None
    explained = (rest - evidence.value) / max(evidence.gap, GAP)
    strength = gap_counts(evidence) * certainty(explained, 0.2, 0.6)
    if strength <= 0.0:
        return None
    share = float(np.abs(heavy.weight[hidden]).sum())
    text = (
        f"{percent(share)} of the value comes from {int(hidden.sum())} samples that something hides from the spot; "
        f"they are {float(heavy.ao[hidden].mean()):.2f} light. Without them AO would be {rest:.2f} instead of "
        f"{evidence.value:.2f}."
    )
    remedies = (Remedy("model", "Split the face along the wall, so that no triangle reaches under it."),)
    return Cause(
        CauseKind.SHEET, strength, text, {"weight_hidden": share, "explained": explained}, remedies, suspect.object
    )


def _surrounding(suspect: Suspect, inside: BoolArray) -> int:
    """The object whose backs the buried samples see most, -1 if none."""
    rays = suspect.explanation.rays
    seen = rays.object[: len(inside)][inside]
    seen = seen[(seen >= 0) & (seen != suspect.object)]
    return int(np.bincount(seen).argmax()) if len(seen) else -1


def _outward(suspect: Suspect) -> Callable[[int], Float64Array]:
    """A function from a vertex to the mean normal of the faces around it."""
    world = suspect.world

    def side(vertex: int) -> Float64Array:
        number = int(np.searchsorted(world.first_vertex, vertex, side="right")) - 1
        faces = world.faces[world.first_face[number] : world.first_face[number + 1]]
        around = faces[(faces == vertex).any(axis=1)]
        normals, area = face_normals(world.positions, around)
        mean = (normals * area[:, None]).sum(axis=0)
        return mean / max(float(np.linalg.norm(mean)), 1e-12)

    return side
