"""In words: which settings are wanted now that a result was not baked with."""

from __future__ import annotations

from bake.rebake.setting_changes import settings_change
from bake.settings import BakeSettings

_MOST_NAMED = 3


def difference_text(baked: BakeSettings, wanted: BakeSettings) -> str:
    """Which settings differ, as rich text of a few lines; empty if none that a bake depends on does.

    Args:
        baked: Of the result.
        wanted: Of the Bake panel.
    """
    change = settings_change(baked, wanted)
    if not change.names:
        return ""
    own, other = wanted.to_json(), baked.to_json()
    names = sorted(name for name in own if name.replace("-", "_") in change.names)
    parts = [f"{name.replace('-', ' ')} {_said(own[name])} (was {_said(other[name])})" for name in names[:_MOST_NAMED]]
    if len(names) > _MOST_NAMED:
        parts.append(f"{len(names) - _MOST_NAMED} more")
    after = "They ask for a whole bake." if change.full else "What is not rebaked keeps the former ones, and is stale."
    return f"<b>Other settings now:</b> {', '.join(parts)}. {after}"


def _said(value: object) -> str:
    if isinstance(value, (list, tuple)):
        return ", ".join(map(str, value))
    return "none" if value is None else str(value)
