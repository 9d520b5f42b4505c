from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest

from bake.explain.cause_names import CauseKind
from bake.explain.causes import name_causes
from bake.explain.explainer import Explainer
from tests.explain.dark_corner import baked, dark_corner, planted_spots


@pytest.fixture(scope="module")
def explainer() -> Iterator[Explainer]:
    """Of the dark corner."""
    with Explainer(baked(dark_corner())) as made:
        yield made


@pytest.mark.parametrize("spot", planted_spots(), ids=lambda spot: spot["label"])
def test_the_planted_spot_is_recognised(explainer: Explainer, spot: dict) -> None:
    """The planted cause comes first, with its remedy, evidence in words and numbers that JSON holds."""
    point = np.array(spot["position"]) - explainer.result.world.origin
    causes = name_causes(explainer, explainer.explain_point(point))
    assert causes[0].kind == spot["cause"]
    assert causes[0].confidence > 0.6
    assert sorted((cause.confidence for cause in causes), reverse=True) == [cause.confidence for cause in causes]
    assert all(0.0 <= cause.confidence <= 1.0 for cause in causes)
    assert CauseKind.CREVICE in {cause.kind for cause in causes}
    printed = json.loads(json.dumps(causes[0].to_json()))
    assert printed["evidence"]
    assert any(character.isdigit() for character in printed["evidence"])
    wanted = spot["remedy"]
    if wanted["kind"] == "none":
        assert causes[0].remedies == ()
    else:
        keys = causes[0].remedies[0].objects
        assert {wanted["key"]: wanted["value"]} in [dict(said) for said in keys.values()]


def test_every_kind_has_words() -> None:
    """Each cause has a heading and a meaning for people."""
    for kind in CauseKind:
        assert kind.heading
        assert kind.meaning.endswith(".")
