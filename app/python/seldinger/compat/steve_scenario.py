"""Vessels and devices of stEVE as a scenario. Needs NumPy alone: branches and shapes are what stEVE's classes have."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from .._core import InputError
from ..gym.batch import Floats

FRAME_RATE = 15.0
START = 5.0  # length inside at the start [mm]; stEVE begins with 0.1

# Between the rigidities that stEVE's moduli give in its units (mm, kg, s: kPa) and those used here. Along rigid walls the shape
# depends on their ratios alone; with 100 the wire of 0.89 mm has the 246 N mm2 of a real one.
_STIFFER = 100.0
_NAMES = {1: ("wire",), 2: ("wire", "catheter"), 3: ("wire", "microcatheter", "catheter"),
          4: ("wire", "microcatheter", "intermediate", "catheter")}


def _direction(line: Floats) -> Floats:
    """Unit vector along the first millimetres of a line."""
    reach = int(np.searchsorted(np.cumsum(np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1)), 5.0)) + 1
    way = line[min(reach, len(line) - 1), :3] - line[0, :3]
    unit: Floats = way / np.linalg.norm(way)
    return unit


def _angle(a: Floats, b: Floats) -> float:
    return math.acos(float(np.clip(a @ b, -1, 1)))


def _rounded(line: Floats) -> Floats:
    """The line at steps of a millimetre, smoothed where it bends more sharply than its lumen allows."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1))])
    steps = np.linspace(0.0, way[-1], max(3, round(way[-1])))
    line = np.stack([np.interp(steps, way, line[:, c]) for c in range(4)], 1)
    for _ in range(500):
        sides = np.diff(line[:, :3], axis=0)
        lengths = np.linalg.norm(sides, axis=1)
        turns = np.arccos(np.clip((sides[1:] * sides[:-1]).sum(1) / (lengths[1:] * lengths[:-1]), -1, 1))
        sharp = np.zeros(len(line))
        sharp[1:-1] = turns * 1.3 * line[1:-1, 3] > 0.5 * (lengths[1:] + lengths[:-1])
        if not sharp.any():
            break
        near = np.convolve(sharp, np.ones(7), "same")[1:-1, None] > 0
        line[1:-1] = np.where(near, 0.25 * line[:-2] + 0.5 * line[1:-1] + 0.25 * line[2:], line[1:-1])
    return line


def vessels(branches: Sequence[Any], insertion: Sequence[float], width: float) -> list[dict[str, Any]]:
    """Branches of stEVE as those of a scenario: each on the centreline of the one that it touches, radii times `width`."""
    left = []
    for branch in branches:
        radii = getattr(branch, "radii", None)
        if radii is None or len(radii) != len(branch.coordinates):
            raise InputError(f"vessel_tree: branch '{branch.name}' has no radii; expected branches with radii, as those of "
                             "AorticArch, AorticArchRandom and FromMesh with BranchWithRadii")
        left.append(np.column_stack([branch.coordinates, width * np.asarray(radii, float)]).astype(float))
    made: list[dict[str, Any]] = []
    first = min(range(len(left)), key=lambda i: float(np.linalg.norm(left[i][:, :3] - insertion, axis=1).min()))
    root = left.pop(first)
    turned = np.linalg.norm(root[0, :3] - insertion) > np.linalg.norm(root[-1, :3] - insertion)
    made.append({"line": _rounded(root[::-1] if turned else root), "parent": None, "goes_on": False})
    while left:
        # The branch and end that lie deepest in what is placed; of those at a branch's end the one that goes on straightest.
        found = []
        for i, line in enumerate(left):
            for p, placed in enumerate(made):
                for own in (line, line[::-1]):
                    trunk = placed["line"]
                    away = np.linalg.norm(trunk[:, :3] - own[0, :3], axis=1)
                    k = int(away.argmin())
                    at_end = k == len(trunk) - 1 and not placed["goes_on"]
                    bend = _angle(_direction(trunk[::-1]) * -1, _direction(own)) if at_end else 9.0
                    found.append((max(0.0, away[k] - trunk[k, 3]), bend, i, p, k, at_end, own))
        gap, _, i, p, k, at_end, line = min(found, key=lambda one: one[:5])
        if gap > 1:
            raise InputError(f"vessel_tree: a branch begins {gap:.1f} mm outside all others; expected branches that touch")
        left.pop(i)
        trunk = made[p]["line"]
        if at_end:
            made[p]["goes_on"] = True
            made[p]["line"] = _rounded(np.vstack([trunk, line[1:]]))
            continue
        # From the trunk's own centre, no wider than it, straight to where the branch leaves its lumen.
        out = int(np.argmax(np.linalg.norm(line[:, :3] - trunk[k, :3], axis=1) > trunk[k, 3]))
        line = np.vstack([[*trunk[k, :3], min(line[0, 3], 0.95 * trunk[k, 3])], line[max(out, 1):]])
        made.append({"line": _rounded(line), "parent": p, "goes_on": False})
    result = []
    for i, one in enumerate(made):
        named: dict[str, Any] = {"name": f"B{i}", "closed": True}
        line = one["line"]
        if one["parent"] is not None:
            trunk = made[one["parent"]]["line"][:, :3]
            k = int(np.linalg.norm(trunk - line[0, :3], axis=1).argmin())
            named.update(parent=f"B{one['parent']}", at_mm=float(np.linalg.norm(np.diff(trunk[:k + 1], axis=0), axis=1).sum()))
            line = line - [*line[0, :3], 0]
        result.append(dict(named, points_mm=line.tolist()))
    return result


def device(shape: Any, friction: float, kind: str) -> dict[str, Any]:
    """A device, of which `shape` is what stEVE gives to SOFA."""
    if not shape.is_a_procedural_shape:
        raise InputError("devices: one with the shape of a mesh was given; expected JShaped or Straight")

    def rigidity(modulus: float, outer: float, inner: float) -> float:
        hollow = inner if inner < outer else 0.0  # DualDeviceNav states a wire whose bore is all of it
        return max(0.001, _STIFFER * 1e-3 * modulus * math.pi * (outer ** 4 - hollow ** 4) / 4)

    shaft = rigidity(shape.young_modulus, shape.radius, shape.inner_radius)
    tip_length = shape.length - shape.straight_length
    radius = 0.5 * shape.spire_diameter
    made: dict[str, Any] = {
        "device": "glidestraight035" if kind == "wire" else "micro17", "length_mm": shape.length,
        "outer_diameter_mm": 2 * shape.radius, "shaft_rigidity_N_mm2": shaft,
        "tip_rigidity_N_mm2": rigidity(shape.young_modulus_extremity, shape.radius_extremity, shape.inner_radius_extremity),
        "tip_length_mm": tip_length, "transition_length_mm": 0.0,
        "torsional_rigidity_N_mm2": shaft / (1 + shape.poisson_ratio), "curved_length_mm": tip_length if radius > 0 else 0.0,
        "curved_angle_deg": math.degrees(tip_length / radius) if radius > 0 else 0.0, "friction": friction,
        "static_friction": friction, "buckling_force_N": 100.0, "valve_friction_N": 0.0, "static_valve_friction_N": 0.0,
        "inserted_mm": START}
    if kind != "wire":
        made.update(inner_diameter_mm=2 * shape.inner_radius, inner_friction=0.0, static_inner_friction=0.0,
                    inserted_mm=0.5 * START)
    return made


def scenario(vessel: dict[str, Any], shapes: Sequence[Any], friction: float) -> dict[str, Any]:
    """Devices, innermost first, in a vessel: the scenario's anatomy, entry, target and what else belongs to it. The wall is as
    hard as stEVE's, which does not give way, bears everything and lets shafts neither bow nor stick outside it."""
    if not 1 <= len(shapes) <= 4:
        raise InputError(f"devices: {len(shapes)} were given; expected 1 to 4")
    made: dict[str, Any] = {"schema": 1, "frame_rate_hz": FRAME_RATE, "wall": {"stiffness_N_per_mm": 20.0},
                            "tissue": {"rigid": True}, "injury": {"off": True}, **vessel}
    for name, shape in zip(_NAMES[len(shapes)], shapes):
        made["guidewire" if name == "wire" else name] = device(shape, friction, name)
    return made


def in_branches(branches: Sequence[Any], insertion: Sequence[float], shapes: Sequence[Any], friction: float,
                width: float = 1.0) -> dict[str, Any]:
    """Devices in the branches of a vessel tree of stEVE."""
    lines = vessels(branches, insertion, width)
    root = np.array(lines[0]["points_mm"])[:, :3]
    return scenario({"title": "Vessels of stEVE", "anatomy": {"branch": lines}, "entry": {"end": "B0.in"},
                     "target": {"centre_mm": root[len(root) // 2].tolist()},
                     "c_arm": {"isocentre_mm": root.mean(0).tolist(), "detector_width_mm": 400.0},
                     "imaging": {"patient": False}}, shapes, friction)


def in_arch(shapes: Sequence[Any], friction: float, view: Sequence[float]) -> dict[str, Any]:
    """Devices in our arch of type I, from the descending aorta on."""
    return scenario({"title": "Devices of stEVE in an aortic arch", "anatomy": {"preset": "arch-1"},
                     "entry": {"end": "aorta.out"}, "target": {"name": "LICA", "radius_mm": 5.0},
                     "c_arm": {"isocentre_mm": [30.0, 20.0, 90.0], "lao_deg": view[0], "cranial_deg": -view[1],
                               "detector_width_mm": 400.0}}, shapes, friction)
