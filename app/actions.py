"""Every action of the window in one list, from which menus, shortcuts and the table of keys are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from PyQt6.QtGui import QAction, QKeySequence
from PyQt6.QtWidgets import QMainWindow


@dataclass(frozen=True, slots=True)
class ActionSpec:
    """One thing the user can do.

    Attributes:
        id: Stable name.
        menu: Menu it stands in; a line is drawn where `group` changes within a menu.
        text: What the menu says.
        tip: What it does, in a sentence.
        keys: Shortcuts, the first one shown in the menu.
        checkable: Whether it switches something on and off.
        group: Group within its menu.
    """

    id: str
    menu: str
    text: str
    tip: str
    keys: tuple[str, ...] = ()
    checkable: bool = False
    group: int = 0


MENUS = ("File", "View", "Bake", "Help")

ACTIONS: tuple[ActionSpec, ...] = (
    ActionSpec("open-scene", "File", "&Open scene …", "Open a glTF, GLB, OBJ or PLY file", ("Ctrl+O",)),
    ActionSpec("open-result", "File", "Open &result …", "Open a result folder", ("Ctrl+Shift+O",)),
    ActionSpec("open-sample", "File", "Open sample &level", "Open the level that comes with Obscura"),
    ActionSpec(
        "save-result", "File", "&Save result as …", "Copy the result to a folder of your own", ("Ctrl+S",), group=2
    ),
    ActionSpec("save-picture", "File", "Save &picture …", "Save the view with its legend as PNG", ("Ctrl+P",), group=2),
    ActionSpec("quit", "File", "&Quit", "Close the window", ("Q", "Ctrl+Q"), group=9),
    ActionSpec("frame", "View", "&Frame", "Show the selected object, or the level without its far backdrop", ("F",)),
    ActionSpec("frame-all", "View", "Frame &everything", "Show everything, backdrop included", ("Shift+F", "Home")),
    ActionSpec("edges", "View", "&Edges", "Draw the edges of the triangles", ("E",), True, 1),
    ActionSpec("shading", "View", "&Light", "Shape the surface by a light at the camera", ("L",), True, 1),
    ActionSpec("back-faces", "View", "Hide &back faces", "Look into closed rooms from outside", ("B",), True, 1),
    ActionSpec("game", "View", "As the &game stores it", "5 bits a pixel, dithered", ("G",), True, 1),
    ActionSpec("blend", "View", "B&lended", "Longest and shortest distance mixed", ("0",), group=2),
    ActionSpec("next-distance", "View", "&Next distance", "Step through the baked distances", ("N",), group=2),
    ActionSpec("geometry", "View", "Geome&try", "The surface without values", ("T",), group=2),
    ActionSpec("invalid", "View", "&Invalid samples", "Mark samples that see too many back faces", ("I",), True, 3),
    ActionSpec(
        "compare", "View", "&Compare mappings", "Average and least squares side by side on one camera", ("C",), True, 3
    ),
    ActionSpec(
        "tree-models",
        "View",
        "Compare tree &models",
        "Global only, local × global and gold of the selected tree side by side",
        ("M",),
        True,
        3,
    ),
    ActionSpec("up-y", "View", "Up is +&Y", "Orbit about the Y axis", (), True, 4),
    ActionSpec("up-z", "View", "Up is +&Z", "Orbit about the Z axis", (), True, 4),
    ActionSpec("light-palette", "View", "Bright window", "Light colours for the panels", (), True, 5),
    ActionSpec("dark-palette", "View", "Dark window", "Dark colours for the panels", (), True, 5),
    ActionSpec("reset-layout", "View", "&Reset layout", "Put all panels back where they were", (), False, 6),
    ActionSpec("bake", "Bake", "&Bake", "Bake with the settings of the panel", ("Ctrl+B", "F5")),
    ActionSpec("cancel", "Bake", "&Cancel", "Stop the bake; without one, let go of the clicked point", ("Escape",)),
    ActionSpec("copy-command", "Bake", "Copy as co&mmand", "The command line that does the same", ("Ctrl+Shift+C",)),
    ActionSpec("keys", "Help", "&Keys and mouse", "What keys and mouse buttons do", ("F1",)),
    ActionSpec("about", "Help", "&About Obscura", "Version and licence"),
)

MOUSE = (
    ("Left drag", "orbit"),
    ("Middle drag, Shift + left drag", "pan"),
    ("Wheel", "zoom at the cursor"),
    ("Right drag", "look around; with W A S D Q E held, fly (wheel: speed)"),
    ("Click", "keep the point in the probe and select its object"),
    ("Double click", "fly to the point"),
)


def build_actions(window: QMainWindow, slots: Mapping[str, Callable[..., object]]) -> dict[str, QAction]:
    """Makes the actions and the menus of a window.

    Args:
        window: Gets the menus.
        slots: What to call by action id; a checkable action passes its new state.

    Raises:
        KeyError: an action has no slot.
    """
    bar = window.menuBar()
    assert bar is not None
    menus = {name: bar.addMenu(f"&{name}") for name in MENUS}
    groups: dict[str, int] = {}
    actions: dict[str, QAction] = {}
    for spec in ACTIONS:
        menu = menus[spec.menu]
        assert menu is not None
        if groups.setdefault(spec.menu, spec.group) != spec.group:
            menu.addSeparator()
            groups[spec.menu] = spec.group
        action = QAction(spec.text, window)
        action.setObjectName(spec.id)
        action.setCheckable(spec.checkable)
        action.setStatusTip(spec.tip)
        action.setToolTip(spec.tip)
        action.setShortcuts([QKeySequence(key) for key in spec.keys])
        slot = slots[spec.id]
        if spec.checkable:
            action.triggered.connect(slot)
        else:
            action.triggered.connect(lambda _checked=False, slot=slot: slot())
        menu.addAction(action)
        actions[spec.id] = action
    return actions


def keys_text() -> str:
    """All keys and mouse gestures as rich text, two tables."""
    keys = "".join(
        f"<tr><td><b>{', '.join(spec.keys)}</b>&nbsp;&nbsp;</td><td>{spec.tip}</td></tr>"
        for spec in ACTIONS
        if spec.keys
    )
    mouse = "".join(f"<tr><td><b>{gesture}</b>&nbsp;&nbsp;</td><td>{what}</td></tr>" for gesture, what in MOUSE)
    return f"<h3>Mouse</h3><table>{mouse}</table><h3>Keys</h3><table>{keys}</table>"
