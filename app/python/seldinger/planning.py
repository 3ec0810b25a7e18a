"""Plans: courses that reach a target, found by search, and what they are worth."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from . import _core
from ._arrays import NDArray
from ._core import InputError
from .simulation import Scenario, _located, assets, default_cache


@dataclass(frozen=True)
class Plan:
    """What was found out about one set of devices. Of `ranked` plans the first is the best.

    devices      as asked for, "glide035+cobra5f"; "own" for the scenario's
    reached      whether a course reaches the target; what follows is then the best one's, else the nearest's
    success      the part of 15 inexact hands that reach it: ten that are off by up to 5 % of every amount, five at
                 the room's keys [-]
    course       its script, which Simulation.apply, `seldinger run` and `play` take a line, or all, of
    scenario     the scenario with these devices, as TOML
    left_mm      way from the nearest state to the target, negative past it [mm]
    seconds      (n,) time of each frame [s]
    tip_mm       (n, 3) place of the tip [mm]
    distance_mm  (n,) from the tip to the target's middle [mm]
    wall_force_N, push_N   (n,) largest force of a joint on the wall, and of the hand [N]
    failures     dicts: how, where and how often moves ended that did not come nearer; keys as in plan.json
    sensitivities   dicts: what the end of the best plan's course depends on; empty for all others
    about        everything else that plan.json has: turns, time_s, air_kerma_mGy, ...
    """

    devices: str
    reached: bool
    success: float
    course: str
    scenario: str
    left_mm: float
    seconds: NDArray[np.float64]
    tip_mm: NDArray[np.float64]
    distance_mm: NDArray[np.float64]
    wall_force_N: NDArray[np.float64]
    push_N: NDArray[np.float64]
    failures: list[dict[str, Any]]
    sensitivities: list[dict[str, Any]]
    about: dict[str, Any]


def _plan_of(text: str) -> Plan:
    made = json.loads(text)
    moments = np.array(made.pop("moments"), dtype=np.float64).reshape(-1, 7)
    return Plan(devices=made.pop("devices"), reached=made.pop("reached"), success=made.pop("success"),
                course=made.pop("course"), scenario=made.pop("scenario"), left_mm=made.pop("left_mm"),
                seconds=moments[:, 0], distance_mm=moments[:, 1], wall_force_N=moments[:, 2], push_N=moments[:, 3],
                tip_mm=moments[:, 4:], failures=made.pop("failures", []), sensitivities=made.pop("sensitivities", []),
                about={key: value for key, value in made.items() if key not in ("schema", "identity")})


def _whole(name: str, value: Any, least: int, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= int(value) <= most:
        raise InputError(f"{name}: {value!r} was given; expected a whole number from {least} to {most}")
    return int(value)


def plan(scenario: Scenario, *, to: str = "", from_: str = "", devices: str = "own", exchange: str = "",
         patient: str = "", threads: int = 2, seed: int = 1, restarts: int = 2, frames: int = 40_000,
         time_limit_s: Optional[float] = None, cache: "Optional[str | os.PathLike[str]]" = None) -> list[Plan]:
    """Searches for courses that reach a target, and ranks sets of devices by them; the best first.

    scenario   a name, a file (.toml or .anatomy.json), or a dict with a scenario's keys
    to         another target: the name of one, a branch, 'BRANCH:20' 20 mm along it, or 'x,y,z' [mm]
    from_      another entry: an open end of the vessels
    devices    what to try, with commas; devices in each other are joined by +, a wire first; 'own', 'wires'
    exchange   wires of the catalogue, with commas, that the wire may be exchanged for through a catheter; 'wires'
    patient    another patient of the scenario: '2', or 'seed:17'
    threads    1 to 256; the plan does not depend on it, and the same seed gives the same plan
    restarts   with other angles, where the target was not reached or few hands could follow, 0 to 100
    frames     to simulate at most in each search, from 1000
    time_limit_s   searches end after this time with the best so far, `about['stopped']` [s]

    Other threads of Python run meanwhile; Ctrl-C ends the call. Raises InputError for what is wrong with the
    scenario, the target or the list of devices; devices that do not fit are in `about['refused']`,
    and wires to exchange that do not in `about['not_tried']`."""
    if time_limit_s is not None and not (isinstance(time_limit_s, (int, float)) and math.isfinite(time_limit_s)
                                         and time_limit_s > 0):
        raise InputError(f"time_limit_s: {time_limit_s!r} was given; expected a time above 0")
    for name, text in (("to", to), ("from_", from_), ("devices", devices), ("exchange", exchange), ("patient", patient)):
        if not isinstance(text, str):
            raise InputError(f"{name}: {type(text).__name__} was given; expected a text")
    where: tuple[str, Optional[str]]
    if isinstance(scenario, (str, os.PathLike)) and os.fspath(scenario).endswith(".anatomy.json"):
        where = os.fspath(scenario), None
    else:
        where = _located(scenario)
    made = _core._plan(where[0], where[1], str(assets() / "devices"), to, from_, devices, exchange, patient,
                       _whole("threads", threads, 1, 256), _whole("seed", seed, 0, 2**63 - 1),
                       _whole("restarts", restarts, 0, 100), _whole("frames", frames, 1000, 10**8), time_limit_s,
                       str(default_cache() if cache is None else os.fspath(cache)))
    return [_plan_of(text) for text in made]
