"""What this machine has and what is missing, each with the command that mends it."""

from __future__ import annotations

import ctypes
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.commands.pictures import run_off_screen
from app.commands.window import SAMPLE_LEVEL, has_display

_ROOT = Path(__file__).resolve().parents[2]
_PROBE_SECONDS = 90.0

OK, OPTIONAL, MISSING = "ok", "optional", "missing"

# What Qt and VTK load at run time on Linux: file, and its package for apt, dnf and pacman.
_SHARED_LIBRARIES = (
    ("libGL.so.1", "libgl1", "mesa-libGL", "libglvnd"),
    ("libEGL.so.1", "libegl1", "mesa-libEGL", "libglvnd"),
    ("libX11.so.6", "libx11-6", "libX11", "libx11"),
    ("libxkbcommon-x11.so.0", "libxkbcommon-x11-0", "libxkbcommon-x11", "libxkbcommon-x11"),
    ("libxcb-cursor.so.0", "libxcb-cursor0", "xcb-util-cursor", "xcb-util-cursor"),
    ("libxcb-icccm.so.4", "libxcb-icccm4", "xcb-util-wm", "xcb-util-wm"),
    ("libxcb-image.so.0", "libxcb-image0", "xcb-util-image", "xcb-util-image"),
    ("libxcb-keysyms.so.1", "libxcb-keysyms1", "xcb-util-keysyms", "xcb-util-keysyms"),
    ("libxcb-randr.so.0", "libxcb-randr0", "libxcb", "libxcb"),
    ("libxcb-render-util.so.0", "libxcb-render-util0", "xcb-util-renderutil", "xcb-util-renderutil"),
    ("libxcb-shape.so.0", "libxcb-shape0", "libxcb", "libxcb"),
    ("libxcb-xfixes.so.0", "libxcb-xfixes0", "libxcb", "libxcb"),
    ("libxcb-xinerama.so.0", "libxcb-xinerama0", "libxcb", "libxcb"),
    ("libdbus-1.so.3", "libdbus-1-3", "dbus-libs", "dbus"),
    ("libfontconfig.so.1", "libfontconfig1", "fontconfig", "fontconfig"),
    ("libglib-2.0.so.0", "libglib2.0-0", "glib2", "glib2"),
)
_INSTALLERS = (("apt-get", "apt-get install -y"), ("dnf", "dnf install -y"), ("pacman", "pacman -S --needed"))
_MESA = ("libegl1 libosmesa6", "mesa-libEGL mesa-libOSMesa", "mesa")

_WAYS = (("EGL", "vtkEGLRenderWindow"), ("OSMesa", "vtkOSOpenGLRenderWindow"))
_DEVICES = (
    "import json; from bake.devices import cuda_devices;"
    "print(json.dumps([[d.alias, d.name, d.memory_mb] for d in cuda_devices()]))"
)
_EMBREE = (
    "import json, numpy as np; from bake.trace.embree_library import EmbreeScene;"
    "scene = EmbreeScene(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32)); scene.close();"
    "print(json.dumps(True))"
)
_DRAW = (
    "import pyvista; plotter = pyvista.Plotter(off_screen=True, window_size=[32, 32]);"
    "plotter.add_mesh(pyvista.Cube(), color='black', lighting=False); picture = plotter.screenshot(return_img=True);"
    "assert picture.min() < 64 and picture.max() > 64"
)


@dataclass(frozen=True, slots=True)
class Check:
    """One thing looked at.

    Attributes:
        name: What was looked at.
        status: "ok", "optional" (absent; the rest works without) or "missing".
        detail: What was found.
        remedy: The command that mends it; empty if nothing is to be done.
    """

    name: str
    status: str
    detail: str
    remedy: str = ""


def run_checks() -> Iterator[Check]:
    """All checks, in order; those that start other processes run side by side."""
    with ThreadPoolExecutor() as pool:
        embree, cuda = pool.submit(_embree), pool.submit(_cuda)
        drawing = [pool.submit(run_off_screen, way, ["-c", _DRAW], patience_s=_PROBE_SECONDS) for _, way in _WAYS]
        yield _python()
        yield from _packages()
        yield embree.result()
        yield from cuda.result()
        if sys.platform.startswith("linux"):
            yield _shared_libraries()
        yield _display()
        yield from _drawing([work.result() for work in drawing])
        yield _sample_level()


def _python() -> Check:
    version = sys.version.split()[0]
    if sys.version_info[:2] in ((3, 11), (3, 12), (3, 13)):
        return Check("Python", OK, version)
    return Check("Python", MISSING, f"{version}; 3.11 to 3.13 are supported", installing("python3.11"))


def _packages() -> Iterator[Check]:
    project = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for requirement in project["dependencies"]:
        name = re.split(r"[^A-Za-z0-9._-]", requirement)[0]
        try:
            yield Check(name, OK, importlib.metadata.version(name))
        except importlib.metadata.PackageNotFoundError:
            yield Check(name, MISSING, f"not installed ({requirement})", "make setup")


def _embree() -> Check:
    found, problem = _ask(_EMBREE)
    if found:
        return Check("Embree", OK, "traces on the CPU")
    return Check("Embree", MISSING, f"does not work: {problem}", "make setup")


def _cuda() -> list[Check]:
    devices, problem = _ask(_DEVICES)
    if devices is None:
        return [Check("Warp", MISSING, f"does not start: {problem}", "make setup")]
    if devices:
        return [Check(f"CUDA device {alias}", OK, f"{name}, {size / 1024:.0f} GB") for alias, name, size in devices]
    remedy = installing("nvidia-driver", "akmod-nvidia", "nvidia") if _has_nvidia_card() else ""
    what = "an NVIDIA card without a working driver" if remedy else "none"
    return [Check("CUDA device", OPTIONAL, f"{what}; bakes on the CPU", remedy)]


def _has_nvidia_card() -> bool:
    for path in Path("/sys/bus/pci/devices").glob("*"):
        try:
            vendor, kind = (path / "vendor").read_text().strip(), (path / "class").read_text().strip()
        except OSError:
            continue
        if vendor == "0x10de" and kind.startswith("0x03"):
            return True
    return False


def _shared_libraries() -> Check:
    lacking = [item for item in _SHARED_LIBRARIES if not _loads(item[0])]
    if not lacking:
        return Check("shared libraries", OK, f"all {len(_SHARED_LIBRARIES)} that the window loads")
    packages = [" ".join(dict.fromkeys(item[i] for item in lacking)) for i in (1, 2, 3)]
    names = ", ".join(item[0] for item in lacking)
    return Check("shared libraries", MISSING, f"the window needs {names}", installing(*packages))


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _display() -> Check:
    if has_display():
        shown = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY") or sys.platform
        return Check("display", OK, shown)
    remedy = "xvfb-run -a python main.py" if shutil.which("xvfb-run") else installing("xvfb")
    return Check("display", OPTIONAL, "none: the window cannot open; all commands work", remedy)


def _drawing(works: list[bool]) -> Iterator[Check]:
    for (name, _), work in zip(_WAYS, works, strict=True):
        if work:
            yield Check(f"off-screen OpenGL ({name})", OK, "draws")
    if not any(works):
        what = "neither EGL nor OSMesa draws: reports have no pictures"
        yield Check("off-screen OpenGL", MISSING, what, installing(*_MESA))


def _sample_level() -> Check:
    if SAMPLE_LEVEL.is_file():
        return Check("sample level", OK, str(SAMPLE_LEVEL.relative_to(_ROOT)))
    return Check("sample level", MISSING, f"{SAMPLE_LEVEL} is not there", "git checkout -- assets")


def installing(apt: str, dnf: str = "", pacman: str = "") -> str:
    """The command that installs packages on this system; empty where no known installer is found."""
    for (program, command), packages in zip(_INSTALLERS, (apt, dnf or apt, pacman or apt), strict=True):
        if shutil.which(program):
            return f"sudo {command} {packages}"
    return ""


def _ask(code: str) -> tuple[Any, str]:
    """Runs Python code in a process of its own, as drivers may take it down; its JSON answer, or None and why."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=_ROOT, capture_output=True, text=True, timeout=_PROBE_SECONDS
        )
        if done.returncode == 0:
            return json.loads(done.stdout.splitlines()[-1]), ""
        lines = done.stderr.strip().splitlines()
        return None, lines[-1][:200] if lines else f"ended with {done.returncode}"
    except (OSError, subprocess.TimeoutExpired, ValueError, IndexError) as error:
        return None, type(error).__name__
