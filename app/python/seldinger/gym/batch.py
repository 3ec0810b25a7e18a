"""What an environment does, for n of them at once: Env has one, VectorEnv several."""

from __future__ import annotations

import operator
import os
from collections import OrderedDict
from numbers import Real
from typing import Any, Callable, Mapping, Optional, Sequence, Union

import numpy as np

from .._core import InputError
from ..simulation import Simulation, VectorSimulation, facts
from .spaces import Box, Dict, Space

SPEED = np.array([35.0, 3.14])  # of an action of 1 [mm/s, rad/s]
FAR = 5000.0  # bounds of places [mm]
FORCE = 1000.0  # bounds of forces [N]
KEYS = ("tracking2d", "tracking3d", "target2d", "target3d", "inserted_length", "rotation", "last_action", "image",
        "guidewire", "phantom", "joint_pos", "joint_vel", "force")
REWARDS = ("path_delta", "distance", "sparse")
RANDOM = ("anatomy_seed", "scenario", "target", "c_arm_deg")
TRUNCATIONS = ("steps", "time", "vessel_end", "not_certified")

Reward = Union[str, Callable[[Mapping[str, Any]], float]]

COMMON = {"devices": "devices", "frame_rate_hz": "frames a second", "pixels": "pixels of the C-arm"}
_MOST_FRAMES = 1_000_000  # of one call of step


def is_number(value: Any) -> bool:
    return isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_)) and bool(np.isfinite(value))


def whole(value: Any) -> Optional[int]:
    """A whole number of Python or NumPy, arrays without dimension among them; None for what is none."""
    try:
        return operator.index(value)
    except TypeError:
        return None


def checked_seed(seed: Any) -> Optional[int]:
    number = None if seed is None else whole(seed)
    if seed is not None and (number is None or number < 0):
        raise InputError(f"seed: {seed!r} was given; expected a whole number of 0 or more, or None")
    return number


def checked_reward(value: Any) -> float:
    """What a callable returned."""
    try:
        number = float("nan") if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not np.isfinite(number):
        raise InputError(f"reward: the callable returned {value!r}; expected a finite number")
    return number


class Batch:
    """n environments; with n=None one, whose actions have no first dimension of 1."""

    def __init__(self, scenario: Any, n: Optional[int], *, obs: Sequence[str] = ("tracking2d", "target2d", "rotation"),
                 image_size: int = 128, n_points: int = 3, resolution_mm: float = 2.0, action: str = "velocity",
                 flat_action: bool = False, reward: Reward = "path_delta", max_episode_steps: int = 300,
                 frame_skip: int = 1, patience: int = 30, randomize: Optional[Mapping[str, Any]] = None,
                 set: Optional[Mapping[str, Any]] = None, cache: Any = None, hashes: bool = True, pool_size: int = 8,
                 beam: bool = False, threads: Optional[int] = None, panel: bool = False) -> None:
        alone, n = n is None, 1 if n is None else n
        if not isinstance(obs, (str, Sequence)):
            raise InputError(f"obs: {obs!r} was given; expected a list of these: " + ", ".join(KEYS))
        self.obs = (obs,) if isinstance(obs, str) else tuple(dict.fromkeys(obs))
        for key in self.obs:
            if key not in KEYS:
                raise InputError(f"obs: '{key}' was found; expected " + ", ".join(KEYS))
        if not self.obs:
            raise InputError("obs: nothing was given; expected one key or more: " + ", ".join(KEYS))
        if action not in ("velocity", "physical"):
            raise InputError(f"action: '{action}' was given; expected 'velocity' or 'physical'")
        if not callable(reward) and reward not in REWARDS:
            raise InputError(f"reward: {reward!r} was given; expected a callable or one of these: "
                             + ", ".join(REWARDS))
        for name, value, least, most in (
                ("n", n, 1, 100_000), ("image_size", image_size, 32, 2048), ("n_points", n_points, 1, 1000),
                ("max_episode_steps", max_episode_steps, 1, None), ("frame_skip", frame_skip, 1, _MOST_FRAMES),
                ("patience", patience, 1, None), ("pool_size", pool_size, 1, None)):
            number = whole(value)
            if number is None or number < least or (most is not None and number > most):
                raise InputError(f"{name}: {value!r} was given; expected a whole number of {least} "
                                 + ("or more" if most is None else f"to {most}"))
        if not is_number(resolution_mm) or not 0 < resolution_mm <= 100:
            raise InputError(f"resolution_mm: {resolution_mm!r} was given; expected a number above 0, up to 100")
        if randomize is not None and not isinstance(randomize, Mapping):
            raise InputError(f"randomize: {randomize!r} was given; expected a dict, of " + ", ".join(RANDOM))
        self.n = n
        self.image_size, self.points, self.spacing = image_size, n_points, resolution_mm
        self.physical, self.flat, self.reward = action == "physical", flat_action, reward
        self.most_steps, self.frames, self.patience, self.hashes = max_episode_steps, frame_skip, patience, hashes
        self.beam, self.panel = bool(beam), panel
        if set is not None and not isinstance(set, Mapping):
            raise InputError(f"set: {set!r} was given; expected a dict of keys and values")
        self.set, self.cache = dict(set or {}), cache
        self.random = dict(randomize or {})
        for key in self.random:
            if key not in RANDOM:
                raise InputError(f"randomize: '{key}' was found; expected " + ", ".join(RANDOM))
        self._check_random()
        self.scenario = scenario
        self._check_scenarios()
        self.pool_size = pool_size
        self.pool: OrderedDict[Any, Simulation] = OrderedDict()
        base = self._simulation(scenario, None)
        self.about = base.about()
        self.devices = self.about["devices"]
        self.step_s = frame_skip / self.about["frame_rate_hz"]
        self._check_branches(self._branches(base))
        self.base_target = self._along_of_target(base)
        self.sim = VectorSimulation(base, n, threads=threads, points=n_points, spacing_mm=resolution_mm)
        self.keys = [base_key(scenario, None)] * n
        self.moved_target = np.zeros(n, bool)
        self.names: list[list[str]] = [self._branches(base)] * n
        self.rng = [np.random.default_rng() for _ in range(n)]
        self.noise = [0] * n
        self.steps = np.zeros(n, np.int64)
        self.restless = np.zeros(n, np.int64)
        self.last = np.zeros((n, self.devices, 2), np.float32)
        self.path = np.zeros(n)
        self.path_at_start = np.ones(n)
        self.track_before = np.zeros((n, n_points, 3))
        limits = SPEED if self.physical else np.ones(2)
        high = np.broadcast_to(limits, (self.devices, 2)).astype(np.float32)
        self.action_space: Space = Box(-high.reshape(-1), high.reshape(-1)) if flat_action else Box(-high, high)
        self.action_shape = self.action_space.shape if alone else (n, *self.action_space.shape)
        self.observation_space = Dict({key: self._space(key, high) for key in self.obs})

    # Spaces

    def _space(self, key: str, high: np.ndarray) -> Space:
        size, points, devices = self.image_size, self.points, self.devices
        if key in ("image", "guidewire", "phantom"):
            return Box(0, 255, (size, size, 1), np.uint8)
        if key == "last_action":
            return Box(-high, high)
        if key == "rotation":
            return Box(-1, 1, (devices, 2))
        if key == "inserted_length":
            return Box(0, FAR, (devices,))
        if key == "force":
            return Box(0, FORCE, (2,))
        shapes = {"tracking2d": (points, 2), "tracking3d": (points, 3), "target2d": (2,), "target3d": (3,),
                  "joint_pos": (3 * points,), "joint_vel": (3 * points,)}
        far = 2.0 * size if key.endswith("2d") else 100 * FAR if key == "joint_vel" else FAR
        return Box(-far, far, shapes[key])

    # Scenes

    def _check_random(self) -> None:
        def refuse(key: str, accepted: str) -> None:
            raise InputError(f"randomize: {key} {self.random[key]!r} was given; expected {accepted}")

        seeds = self.random.get("anatomy_seed")
        if seeds is not None:
            ends = [whole(seed) for seed in seeds] if isinstance(seeds, (list, tuple, np.ndarray)) else []
            if len(ends) != 2 or None in ends or not 0 <= ends[0] < ends[1]:
                refuse("anatomy_seed", "(first, end) of seeds, two whole numbers of 0 or more,")
            self.random["anatomy_seed"] = tuple(ends)
        tilt = self.random.get("c_arm_deg", 0)
        if not is_number(tilt) or not 0 <= tilt <= 45:
            refuse("c_arm_deg", "a number from 0 to 45")
        target = self.random.get("target", "scenario")
        if isinstance(target, str):
            known = target in ("scenario", "branches", "targets")
        else:
            known = (isinstance(target, (list, tuple)) and len(target) > 0
                     and all(isinstance(branch, str) for branch in target))
        if not known:
            refuse("target", "'branches', 'targets' or a list of branches")
        choices = self.random.get("scenario")
        if isinstance(choices, (str, os.PathLike, Mapping)):
            self.random["scenario"] = (choices,)
        elif choices is not None and not (isinstance(choices, (list, tuple)) and len(choices) > 0):
            refuse("scenario", "a scenario or a list of them")

    def _check_scenarios(self) -> None:
        """Scenarios that take turns share the spaces, the length of a step and the scale of the images."""
        choices = self.random.get("scenario", ())
        first = facts(self.scenario, self.set) if choices else {}
        for choice in choices:
            other = facts(choice, self.set)
            for key, what in COMMON.items():
                if other[key] != first[key]:
                    raise InputError(f"randomize: expected scenarios with equally many {what}; {self._name(choice)} "
                                     f"has {other[key]}, {self._name(self.scenario)} has {first[key]}")

    @staticmethod
    def _name(scenario: Any) -> str:
        return "the dict" if isinstance(scenario, Mapping) else f"'{os.fspath(scenario)}'"

    def _check_branches(self, there: Sequence[str]) -> None:
        target = self.random.get("target", "scenario")
        if isinstance(target, str) or "scenario" in self.random:
            return  # of other vessels it is found when they are drawn
        for name in target:
            if name not in there:
                raise InputError(f"randomize: target branch '{name}' was given; expected " + ", ".join(there))

    def _simulation(self, scenario: Any, seed: Optional[int]) -> Simulation:
        key = base_key(scenario, seed)
        if key in self.pool:
            self.pool.move_to_end(key)
            return self.pool[key]
        values = dict(self.set)
        if seed is not None:
            values["anatomy.seed"] = int(seed)
        made = Simulation(scenario, set=values, images="dose" if self.beam else False, panel=self.panel,
                          cache=self.cache)
        self.pool[key] = made
        if len(self.pool) > self.pool_size:
            self.pool.popitem(last=False)
        return made

    @staticmethod
    def _branches(sim: Simulation) -> list[str]:
        return [branch["name"] for branch in sim.anatomy()["branches"]]

    @staticmethod
    def _along_of_target(sim: Simulation) -> tuple[str, float]:
        """Branch of the scenario's target, and how far along it that is [mm]."""
        target = sim.state.target_mm
        best = (np.inf, "", 0.0)
        for branch in sim.anatomy()["branches"]:
            points = branch["points_mm"]
            away = np.linalg.norm(points - target, axis=1) - branch["radii_mm"]
            k = int(away.argmin())
            way = float(np.linalg.norm(np.diff(points[:k + 1], axis=0), axis=1).sum())
            best = min(best, (float(away[k]), branch["name"], way))
        return best[1], best[2]

    def _place(self, i: int, sim: Simulation, rng: np.random.Generator, other_vessels: bool) -> None:
        """Draws the target of the i-th simulation."""
        wanted = self.random.get("target", "scenario")
        anatomy = sim.anatomy()
        branches = {branch["name"]: branch for branch in anatomy["branches"]}
        if isinstance(wanted, str) and wanted == "targets":
            names = [target["name"] for target in anatomy["targets"]]
            if not names:
                raise InputError("randomize: target 'targets' was given, and these vessels name none; "
                                 "expected 'branches'")
            self.sim.aim(i, names[int(rng.integers(len(names)))])
            self.moved_target[i] = True
        elif isinstance(wanted, str) and wanted == "scenario":
            if other_vessels and self.base_target[0] in branches:
                branch, along = branches[self.base_target[0]], self.base_target[1]
                self.sim.aim(i, _at(branch, along))
                self.moved_target[i] = True
        else:
            names = list(branches) if isinstance(wanted, str) else list(wanted)
            for name in names:
                if name not in branches:
                    raise InputError(f"randomize: target branch '{name}' was given; expected "
                                     + ", ".join(branches))
            branch = branches[names[int(rng.integers(len(names)))]]
            length = float(np.linalg.norm(np.diff(branch["points_mm"], axis=0), axis=1).sum())
            self.sim.aim(i, _at(branch, float(rng.uniform(0.3, 0.9)) * length))
            self.moved_target[i] = True

    def _scene(self, i: int) -> None:
        rng = self.rng[i]
        scenario, seed, sim = self.scenario, None, None
        choices = self.random.get("scenario")
        seeds = self.random.get("anatomy_seed")
        for _ in range(50):
            if choices:
                scenario = choices[int(rng.integers(len(choices)))]
            if seeds is not None:
                seed = int(rng.integers(seeds[0], seeds[1]))
            try:
                sim = self._simulation(scenario, seed)
                break
            except InputError:  # wire or target of the scenario do not fit these vessels: others are drawn
                if seeds is None:
                    raise
        if sim is None:
            raise InputError(f"randomize: none of 50 anatomies of the seeds {seeds} takes the scenario's wire and target")
        key = base_key(scenario, seed)
        if key != self.keys[i] or self.moved_target[i]:
            self.sim.assign(i, sim)
            self.keys[i], self.names[i] = key, self._branches(sim)
            self.moved_target[i] = False
        else:
            one = np.zeros(self.n, bool)
            one[i] = True
            self.sim.reset(one)
        self._place(i, sim, rng, seed is not None)
        tilt = self.random.get("c_arm_deg", 0)
        if tilt:
            about = sim.about()
            lao, cranial = rng.uniform(-tilt, tilt, 2)
            self.sim.apply(i, f"arm lao {np.clip(about['lao_deg'] + lao, -120, 120):.6f} deg "
                              f"cranial {np.clip(about['cranial_deg'] + cranial, -45, 45):.6f} deg")
        if self.beam:
            self.sim.apply(i, "beam on")
        self.noise[i] = int(rng.integers(2 ** 53))

    def way(self) -> np.ndarray:
        """(n,) mm: along centrelines to the target, straight where there is no way."""
        path = self.sim.path_to_target_mm
        return np.where(np.isnan(path), self.sim.tip_to_target_mm, path)

    # The contract

    def require_open(self) -> None:
        if self.sim.closed:
            raise InputError("the environment is closed; expected one that is open")

    def reset(self, which: np.ndarray, seeds: Sequence[Optional[int]]) -> None:
        for i in np.flatnonzero(which):
            if seeds[i] is not None:
                self.rng[i] = np.random.default_rng(int(seeds[i]))
            self._scene(int(i))
        self.steps[which] = self.restless[which] = 0
        self.last[which] = 0
        way = self.way()
        self.path[which] = way[which]
        self.path_at_start[which] = np.maximum(way[which], 1e-9)
        self.track_before[which] = self.sim.track_mm[which]

    def numbers(self, actions: Any, active: Optional[np.ndarray] = None) -> np.ndarray:
        """Actions as (n, devices, 2) float32, finite where active, by default all. Raises InputError for others, arrays of
        another shape among them."""
        found = type(actions).__name__
        try:
            given = np.asarray(actions)
            found = f"shape {given.shape}"
            if given.dtype.kind not in "biufO":
                raise TypeError
            with np.errstate(over="ignore"):
                given = given.astype(np.float32)
        except (TypeError, ValueError):
            raise InputError(f"action: expected numbers of shape {self.action_shape}, found {found} of {actions!r}"[:300]) \
                from None
        if given.shape != self.action_shape:
            raise InputError(f"action: expected shape {self.action_shape}, found {given.shape}")
        given = given.reshape(self.n, self.devices, 2)
        if not np.isfinite(given if active is None else given[active]).all():
            raise InputError("action: a number that is not finite was given; expected finite ones")
        return given

    def checked(self, actions: Any, active: np.ndarray) -> np.ndarray:
        """The same within the space, 0 where not active."""
        limits = (SPEED if self.physical else np.ones(2)).astype(np.float32)
        return np.clip(np.where(active[:, None, None], self.numbers(actions, active), 0), -limits, limits)

    def act(self, given: np.ndarray, active: np.ndarray) -> None:
        """Makes a step of what checked() returned."""
        speed = given.astype(np.float64) * (1.0 if self.physical else SPEED)
        self.track_before[active] = self.sim.track_mm[active]
        self.last[active] = given[active]
        self.sim.step(speed * (self.step_s / self.frames), frames=self.frames, active=active)
        self.steps[active] += 1
        restless = ~self.sim.at_rest | self.sim.refused
        self.restless = np.where(active, np.where(restless, self.restless + 1, 0), self.restless)

    def observe(self) -> dict[str, np.ndarray]:
        """Arrays of shape (n, …), new ones."""
        sim, made = self.sim, {}
        scale = self.image_size / self.about["pixels"]
        images = masks = None
        for key in self.obs:
            if key == "image":
                images = sim.images(self.image_size, seeds=self.noise)
                made[key] = images[..., None]
                continue
            if key in ("guidewire", "phantom"):
                masks = masks if masks is not None else sim.masks(self.image_size)
                made[key] = masks["wire" if key == "guidewire" else "vessels"][..., None]
                continue
            if key in ("tracking2d", "target2d"):
                value = (sim.track_px if key == "tracking2d" else sim.target_px) * scale
            elif key == "tracking3d":
                value = sim.track_mm
            elif key == "target3d":
                value = sim.target_mm
            elif key == "inserted_length":
                value = sim.inserted_mm[:, :self.devices]
            elif key == "rotation":
                turned = np.radians(sim.turned_deg[:, :self.devices])
                value = np.stack([np.sin(turned), np.cos(turned)], -1)
            elif key == "last_action":
                value = self.last
            elif key == "force":
                value = np.stack([sim.tip_force_N, sim.wall_force_N], -1)
            elif key == "joint_pos":
                value = sim.track_mm.reshape(self.n, -1)
            else:
                value = (sim.track_mm - self.track_before).reshape(self.n, -1) / self.step_s
            space = self.observation_space[key]
            made[key] = np.clip(value, space.low, space.high).astype(np.float32)
        return made

    def judge(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Rewards, terminated, truncated and infos, arrays of n."""
        sim = self.sim
        way = self.way()
        reached = sim.on_target & active
        reasons = {"not_certified": self.restless >= self.patience, "vessel_end": sim.past_vessel_end,
                   "time": sim.time_is_up, "steps": self.steps >= self.most_steps}
        why = np.full(self.n, None, object)
        for name, holds in reasons.items():
            why[holds & active & ~reached] = name
        truncated = np.array([reason is not None for reason in why])
        info: dict[str, Any] = {
            "success": reached.copy(), "truncation": why, "branch": np.array(
                [self.names[i][b] for i, b in enumerate(sim.branch)], object),
            "path_ratio": way / self.path_at_start, "path_to_target_mm": way,
            "tip_to_target_mm": sim.tip_to_target_mm.copy(), "tip_force_N": sim.tip_force_N.copy(),
            "wall_force_N": sim.wall_force_N.copy(), "push_N": sim.push_N[:, :self.devices].copy(),
            "torque_Nmm": sim.torque_Nmm[:, :self.devices].copy(), "certified": sim.certified.copy(),
            "time_s": sim.time_s.copy(),
            "dose": {"air_kerma_mGy": sim.air_kerma_mGy.copy(), "area_product_Gycm2": sim.area_product_Gycm2.copy()}}
        if self.hashes:
            # Signed: gymnasium puts whole numbers together as int64, and tensors and JSON hold no more.
            info["hash"] = sim.hashes().view(np.int64)
        if callable(self.reward):
            parts = {"callable": np.array([checked_reward(self.reward(one(info, i))) if active[i] else 0.0
                                           for i in range(self.n)])}
        elif self.reward == "path_delta":
            parts = {"path_delta": 0.01 * (self.path - way), "target": 1.0 * reached, "step": np.full(self.n, -0.001)}
        elif self.reward == "distance":
            parts = {"distance": -0.001 * sim.tip_to_target_mm, "target": 10.0 * reached}
        else:
            parts = {"target": 1.0 * reached}
        parts = {name: np.where(active, part, 0.0) for name, part in parts.items()}
        info["reward"] = parts
        self.path = np.where(active, way, self.path)
        return sum(parts.values()), reached, truncated, info


def base_key(scenario: Any, seed: Optional[int]) -> Any:
    return (scenario if isinstance(scenario, str) else id(scenario), seed)


def _at(branch: Mapping[str, Any], along: float) -> np.ndarray:
    """The place so far along a branch [mm]."""
    points = branch["points_mm"]
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return points[int(np.abs(ways - min(along, 0.95 * ways[-1])).argmin())]


def one(info: Mapping[str, Any], i: int) -> dict[str, Any]:
    """The info of one environment."""
    return {key: {name: float(part[i]) for name, part in value.items()} if isinstance(value, dict)
            else value[i].item() if isinstance(value[i], np.generic) else value[i] for key, value in info.items()}


def with_masks(info: Mapping[str, Any], given: np.ndarray) -> dict[str, Any]:
    """The infos of those that are `given` (n,) bool, as gymnasium's VectorEnv puts them together: under each key an array
    of n, 0 or None for the others, and under _key the mask. Dicts are such infos themselves."""
    made: dict[str, Any] = {}
    for key, value in info.items():
        if isinstance(value, dict):
            made[key] = with_masks(value, given)
        else:
            made[key] = np.full(value.shape, None if value.dtype == object else 0, value.dtype)
            made[key][given] = value[given]
        made["_" + key] = given.copy()
    return made
