"""What the mouse buttons do to the camera, in the manner of the programs that people come from."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from PyQt6.QtCore import Qt

Button, Modifier = Qt.MouseButton, Qt.KeyboardModifier
_MODIFIERS = Modifier.ShiftModifier | Modifier.ControlModifier | Modifier.AltModifier
_NONE = Modifier.NoModifier
_BUTTONS = {Button.LeftButton: "left", Button.MiddleButton: "middle", Button.RightButton: "right"}


class Motion(enum.Enum):
    """What a drag does."""

    ORBIT = "orbit"
    PAN = "pan"
    ZOOM = "zoom"
    LOOK = "look around"


Drag = tuple[Qt.MouseButton, Qt.KeyboardModifier, Motion]


@dataclass(frozen=True, slots=True)
class NavigationStyle:
    """Which drag does what; clicks, wheel and flying are the same in all.

    Attributes:
        title: What it is called.
        drags: Button and modifiers of each motion.
    """

    title: str
    drags: tuple[Drag, ...]

    def motion(self, button: Qt.MouseButton, modifiers: Qt.KeyboardModifier) -> Motion | None:
        """What a drag does; modifiers that mean nothing count as none; None for nothing."""
        motions = {keys: motion for known, keys, motion in self.drags if known is button}
        return motions.get(modifiers & _MODIFIERS, motions.get(_NONE))

    def gestures(self) -> tuple[tuple[str, str], ...]:
        """All gestures and what they do, for people."""
        words: dict[Motion, list[str]] = {}
        for button, keys, motion in self.drags:
            words.setdefault(motion, []).append(f"{_keys_text(keys)}{_BUTTONS[button]} drag")
        look = words.pop(Motion.LOOK, [])
        return (
            *((", ".join(drags).capitalize(), motion.value) for motion, drags in words.items()),
            ("Wheel", "zoom at the cursor"),
            (", ".join(look).capitalize(), "look around; with W A S D Q E held, fly (wheel: speed)"),
            ("Click", "keep the point in the probe and select its object"),
            ("Double click", "fly to the point"),
        )


def _keys_text(keys: Qt.KeyboardModifier) -> str:
    names = (("Shift", Modifier.ShiftModifier), ("Ctrl", Modifier.ControlModifier), ("Alt", Modifier.AltModifier))
    return "".join(f"{name} + " for name, key in names if keys & key)


_LOOK = (Button.RightButton, _NONE, Motion.LOOK)
STYLES = {
    "obscura": NavigationStyle(
        "Obscura",
        (
            (Button.LeftButton, _NONE, Motion.ORBIT),
            (Button.MiddleButton, _NONE, Motion.PAN),
            (Button.LeftButton, Modifier.ShiftModifier, Motion.PAN),
            _LOOK,
        ),
    ),
    "maya": NavigationStyle(
        "Maya",
        (
            (Button.LeftButton, Modifier.AltModifier, Motion.ORBIT),
            (Button.MiddleButton, Modifier.AltModifier, Motion.PAN),
            (Button.MiddleButton, _NONE, Motion.PAN),
            (Button.RightButton, Modifier.AltModifier, Motion.ZOOM),
            _LOOK,
        ),
    ),
    "blender": NavigationStyle(
        "Blender",
        (
            (Button.MiddleButton, _NONE, Motion.ORBIT),
            (Button.MiddleButton, Modifier.ShiftModifier, Motion.PAN),
            (Button.MiddleButton, Modifier.ControlModifier, Motion.ZOOM),
            _LOOK,
        ),
    ),
}
