"""Causes that lie in the geometry or its keys: what was baked is what the rays saw, and they saw the wrong thing."""

from __future__ import annotations

import numpy as np

from bake.explain.cause_names import CauseKind
from bake.explain.cause_types import Cause, Remedy, certainty, darker, percent
from bake.explain.object_signs import shell_around, turned_share, wound_against_neighbours
from bake.explain.suspect import Suspect
from bake.explain.types import Share
from bake.geometry import face_normals
from bake.types import Float64Array, Role

SHELL_SHARE = 0.15, 0.35
"""Share of the darkness below which no shell is looked for, and from which on it may be one: half of what is seen from
inside a shell is the ground that it encloses."""

NOT_CROSSED = 0.5
"""Confidence in a shell that nothing goes through: it may as well be a room."""

OTHER_SIDE, ONE_OF_TWO = 0.125, 0.1
"""AO by which the other side of a face must be lighter than this one, or than the value that both share."""

MOST_SHELL_FACES = 50_000
"""Shells are coarse."""


def against_face(suspect: Suspect) -> Cause | None:
    """The faces show to the inside: rays leave on the wrong side."""
    evidence, number = suspect.evidence, suspect.object
    lighter = evidence.seen_behind - evidence.seen
    if lighter <= 0.0:
        return None
    turned = turned_share(suspect.explainer.result, number)
    patch = wound_against_neighbours(suspect.world, number, suspect.explanation.spot.face)
    sign = max(certainty(turned, 0.02, 0.2), 0.7 if patch else 0.0)
    strength = sign * darker(evidence.seen, evidence.seen_behind, OTHER_SIDE)
    if strength <= 0.0:
        return None
    what = (
        f"The file's normals of {percent(turned)} of the object's vertices point to the back of all their faces"
        if turned > 0.0
        else "The face is wound against its neighbours"
    )
    own = percent(float(evidence.front.on_own.mean()))
    text = (
        f"{what}. On the side that the faces show, AO is {evidence.seen:.2f} and {own} of the hits are on the object "
        f"itself; on the other side it is {evidence.seen_behind:.2f}."
    )
    remedies = (
        Remedy("winding", "Turn the faces to the side of their normals.", {suspect.path: {"winding": "normals"}}),
        Remedy("winding", "Turn all faces of the object round.", {suspect.path: {"winding": "flipped"}}),
    )
    numbers = {"turned": turned, "front": evidence.seen, "behind": evidence.seen_behind}
    return Cause(CauseKind.AGAINST_FACE, strength, text, numbers, remedies, number)


def coplanar_twin(suspect: Suspect) -> Cause | None:
    """Two surfaces in one place: opposed faces that share the value, or one surface that covers another."""
    return max((_shared(suspect), _covered(suspect)), key=lambda cause: cause.confidence if cause else -1.0)


def _shared(suspect: Suspect) -> Cause | None:
    """Opposed faces on the same vertices have one value between them."""
    evidence, world = suspect.evidence, suspect.world
    unknown = suspect.explainer.mapper.surface.unknown
    corners = np.sort(unknown[world.faces[evidence.faces]], axis=1)
    normals = _normals(suspect)
    pairs = 0
    for row in range(len(corners)):
        same = (corners == corners[row]).all(axis=1)
        pairs += bool((normals[same] @ normals[row] < -0.99).any())
    if pairs == 0:
        return None
    apart = abs(evidence.seen - evidence.seen_behind)
    best = max(evidence.seen, evidence.seen_behind)
    strength = certainty(pairs / len(corners), 0.1, 0.5) * darker(evidence.value, best, ONE_OF_TWO)
    if strength <= 0.0:
        return None
    text = (
        f"{pairs} of {len(corners)} faces around have a twin on the same vertices that looks the other way. One side "
        f"sees {evidence.seen:.2f}, the other {evidence.seen_behind:.2f}; both share the value {evidence.value:.2f}."
    )
    remedies = (
        Remedy("two-sided", "Make one surface of the twins.", {suspect.path: {"two_sided": True}}),
        Remedy("model", "Give the back its own vertices."),
    )
    return Cause(CauseKind.TWIN, strength, text, {"twins": pairs, "apart": apart}, remedies, suspect.object)


def _covered(suspect: Suspect) -> Cause | None:
    """A parallel surface less than a millimetre above takes the light."""
    heavy = suspect.evidence.heavy
    weight = np.maximum(heavy.weight, 0.0)
    dark = float(weight @ (1.0 - heavy.ao))
    taken = float(weight @ heavy.covered)
    if taken < 0.03 or dark <= 0.0 or heavy.covering < 0:
        return None
    covered = float(weight[heavy.covered > 0.5].sum())
    strength = certainty(taken / dark, 0.2, 0.6) * certainty(taken, 0.04, 0.15)
    if strength <= 0.0:
        return None
    name = suspect.world.object_paths[heavy.covering]
    text = (
        f"{name} lies less than 1 mm above and parallel: samples with {percent(covered)} of the weight are covered by "
        f"it, which makes {percent(taken / dark)} of the darkness."
    )
    remedies: list[Remedy] = []
    if heavy.covering != suspect.object:
        remedies.append(
            Remedy("role", f"Let {name} receive but not cast.", {name: {"role": str(Role.RECEIVER)}}),
        )
    remedies.append(Remedy("offset", "Start rays 2 mm above this object.", {suspect.path: {"offset": 0.002}}))
    return Cause(CauseKind.TWIN, strength, text, {"taken": taken, "darkness": dark}, tuple(remedies), heavy.covering)


def enclosing_shell(suspect: Suspect) -> Cause | None:
    """A closed surface around the spot takes most of the light."""
    column = suspect.evidence.column
    darkness = float(suspect.explanation.darkness[column])
    if darkness < 0.15:
        return None
    found = [
        _shell(suspect, share, float(share.share[column]) / darkness)
        for share in suspect.explanation.occluders
        if not share.is_self and float(share.share[column]) > SHELL_SHARE[0] * darkness
    ]
    return max(found, key=lambda cause: cause.confidence if cause else -1.0, default=None)


def _shell(suspect: Suspect, top: Share, part: float) -> Cause | None:
    """Whether one occluder, which takes `part` of the darkness, is a shell around the spot."""
    world = suspect.world
    if world.first_face[top.object + 1] - world.first_face[top.object] > MOST_SHELL_FACES:
        return None
    shell = shell_around(world, top.object, suspect.explanation.spot.position)
    told = any(
        finding.what == "encloses-scene" and finding.object == top.name for finding in suspect.explainer.result.findings
    )
    round_it = certainty(abs(shell.winding), 0.8, 0.95) * certainty(shell.closed, 0.9, 0.99)
    hollow = certainty(shell.inward, 0.7, 0.9)
    alien = 1.0 if told or shell.crossed else NOT_CROSSED
    strength = max(round_it * hollow * alien, 1.0 if told else 0.0) * certainty(part, *SHELL_SHARE)
    if strength <= 0.0:
        return None
    text = (
        f"{top.name} takes {percent(part)} of the darkness. It is a closed surface around the spot (winding number "
        f"{shell.winding:+.2f}, {percent(shell.closed)} of its edges closed, {percent(shell.inward)} of it faces "
        f"inwards)" + (f"; {shell.crossed} other objects pass through it." if shell.crossed else ".")
    )
    remedies = (
        Remedy("role", f"Let {top.name} take no part in the bake.", {top.name: {"role": str(Role.IGNORE)}}),
        Remedy("role", f"Let {top.name} receive but not cast.", {top.name: {"role": str(Role.RECEIVER)}}),
    )
    numbers = {"share": part, "winding": shell.winding, "closed": shell.closed, "inward": shell.inward}
    return Cause(CauseKind.SHELL, strength, text, numbers, remedies, top.object)


def wrong_length(suspect: Suspect) -> Cause | None:
    """An offset that starts rays in other things, or a level whose size and distances do not fit."""
    return max((_offset(suspect), _unit(suspect)), key=lambda cause: cause.confidence if cause else -1.0)


def _offset(suspect: Suspect) -> Cause | None:
    heavy = suspect.evidence.heavy
    keys = suspect.world.object_keys
    owner: list[int] = suspect.explanation.samples.object[heavy.row].tolist()
    offsets = np.array([keys[number].offset or 0.0 for number in owner])
    largest = float(offsets.max(initial=0.0))
    if largest < 1e-3:
        return None
    rays = suspect.explanation.rays
    count = len(heavy.row)
    origins = rays.origin[:count].astype(np.float64) - offsets[:, None] * heavy.face_normal
    gain = suspect.change(suspect.retraced(origins, rays.direction[:count].astype(np.float64)))
    strength = certainty(abs(gain), 0.03, 0.1)
    if strength <= 0.0:
        return None
    number = owner[int(np.argmax(offsets))]
    name = suspect.world.object_paths[number]
    text = f"Rays start {largest:g} m above {name}, its offset; without it AO would be {gain:+.2f}."
    remedies = (
        Remedy("offset", "Let rays start on the surface.", {name: {"offset": 0.0}}),
        Remedy("offset", "Start them a millimetre above.", {name: {"offset": 0.001}}),
    )
    return Cause(CauseKind.UNIT, strength, text, {"offset_m": largest, "gain": gain}, remedies, number)


def _unit(suspect: Suspect) -> Cause | None:
    dark = certainty(suspect.evidence.value, 0.8, 0.5)
    if dark <= 0.0:
        return None
    longest, shortest = suspect.longest_side(), min(suspect.explanation.distances)
    strength = 0.95 * certainty(longest / shortest, 1.5, 0.75) * dark
    if strength <= 0.0:
        return None
    text = (
        f"The whole level measures {longest:.3g} m, the shortest distance {shortest:g} m: all of it counts as near. "
        "If the file's unit is not the metre, its lengths are wrong by that factor."
    )
    scale = longest / 20.0
    distances = [float(f"{scale * distance:.2g}") for distance in suspect.explanation.distances]
    remedies = (
        Remedy("setting", f"Bake with distances {distances}.", options={"distances": distances}),
        Remedy("model", "Export the level in metres."),
    )
    return Cause(CauseKind.UNIT, strength, text, {"longest_m": longest, "shortest_distance_m": shortest}, remedies)


def one_layer(suspect: Suspect) -> Cause | None:
    """A single layer of two-sided faces whose light side is not the one that was baked."""
    evidence, world = suspect.evidence, suspect.world
    faces = evidence.faces
    two_sided = float(world.face_two_sided[faces].mean())
    lighter = evidence.seen_behind - max(evidence.seen, evidence.value)
    if two_sided < 0.5 or lighter <= 0.05:
        return None
    strength = certainty(lighter, 0.08, 0.25) * (
        1.0 - certainty(turned_share(suspect.explainer.result, suspect.object), 0.02, 0.2)
    )
    if strength <= 0.0:
        return None
    text = (
        f"The faces are two-sided and have one value for both sides. It was baked where they show to, which sees "
        f"{evidence.seen:.2f}; the other side sees {evidence.seen_behind:.2f}."
    )
    remedies = (
        Remedy("winding", "Turn the faces round, to bake the other side.", {suspect.path: {"winding": "flipped"}}),
        Remedy("model", "Give the sheet a back of its own."),
    )
    numbers = {"front": evidence.seen, "behind": evidence.seen_behind}
    return Cause(CauseKind.SHEET, strength, text, numbers, remedies, suspect.object)


def _normals(suspect: Suspect) -> Float64Array:
    return face_normals(suspect.world.positions, suspect.world.faces[suspect.evidence.faces])[0]
