"""What an environment does, for n of them at once: Env has one, VectorEnv several."""

from __future__ import annotations

import hashlib
import json
from collections import OrderedDict, deque
from typing import Any, Callable, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from .._arrays import NDArray
from .._core import InputError, Snapshot
from ..simulation import Place, Simulation, VectorSimulation, _aim, same_target
from .draws import STAND, Draws, checked_values, is_number, whole
from .spaces import Box, Dict, Space

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

SPEED = np.array([35.0, 3.14])  # of an action of 1 on a device [mm/s, rad/s]
STAND_SPEED = {"c_arm": (20.0, 20.0), "table": (100.0, 100.0)}  # LAO and cranial [deg/s]; to the left and the head [mm/s]
REACH = np.array([180.0, 140.0, 600.0])  # of the table in either direction [mm]
FAR = 5000.0  # bounds of places [mm]
FORCE = 1000.0  # bounds of forces [N]
KEYS = ("tracking2d", "tracking3d", "target2d", "target3d", "tip2d", "tip3d", "inserted_length", "rotation", "last_action",
        "image", "guidewire", "phantom", "joint_pos", "joint_vel", "force", "c_arm", "table", "route2d", "route3d")
OF_DEVICE = ("tracking2d", "tracking3d", "mask")  # with a device's name before them: catheter_mask
REWARDS = ("path_delta", "distance", "sparse")
OPTIONS = ("seed", "target", "start", "set")
RENDER_MODES = ("rgb_array", "panel")

Reward = Union[str, Callable[[Mapping[str, Any]], float]]

_MOST_FRAMES = 1_000_000  # of one call of step
_TRIES = 50  # of draws that fit no vessels
_REMEMBERED = 100  # episodes


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


class EnvSnapshot(NamedTuple):
    """The whole state of an environment, made by Env.snapshot(): of the simulation, of the episode and of what is drawn. It
    can be pickled."""

    like: Simulation
    target: Place
    simulation: Snapshot
    drawn: Mapping[str, Any]
    names: Sequence[str]
    rng: Any
    own: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"<EnvSnapshot after {self.own['steps']} steps, {len(self.simulation)} bytes>"


class Batch:
    """n environments; with n=None one, whose actions have no first dimension of 1."""

    # Arrays of n, or lists, that make up the state of an environment besides its simulation's.
    _OWN = ("steps", "restless", "last", "path", "path_at_start", "track_before", "noise", "salt", "jitter", "spread",
            "latency", "queue", "done", "won", "moved_target")

    def __init__(self, scenario: Any, n: Optional[int], *, obs: Union[str, Sequence[str], None] = None,
                 image_size: int = 128, n_points: int = 3, resolution_mm: float = 2.0, route_points: int = 8,
                 route_spacing_mm: float = 10.0, action: str = "velocity",
                 flat_action: bool = False, stand: Union[str, Sequence[str]] = (), reward: Reward = "path_delta",
                 max_episode_steps: Optional[int] = 300, frame_skip: int = 1, patience: int = 30, randomize: Any = None,
                 set: Optional[Mapping[str, Any]] = None, cache: Any = None, hashes: bool = True, pool_size: int = 8,
                 beam: bool = False, render_mode: Optional[str] = None, threads: Optional[int] = None) -> None:
        alone, n = n is None, 1 if n is None else n
        if action not in ("velocity", "physical"):
            raise InputError(f"action: '{action}' was given; expected 'velocity' or 'physical'")
        if not callable(reward) and reward not in REWARDS:
            raise InputError(f"reward: {reward!r} was given; expected a callable or one of these: "
                             + ", ".join(REWARDS))
        if render_mode not in (None, *RENDER_MODES):
            raise InputError(f"render_mode: {render_mode!r} was given; expected 'rgb_array', 'panel' or None")
        for name, value, least, most in (
                ("n", n, 1, 100_000), ("image_size", image_size, 32, 2048), ("n_points", n_points, 1, 1000),
                ("route_points", route_points, 1, 1000),
                ("max_episode_steps", 1 if max_episode_steps is None else max_episode_steps, 1, None),
                ("frame_skip", frame_skip, 1, _MOST_FRAMES), ("patience", patience, 1, None), ("pool_size", pool_size, 1, None)):
            number = whole(value)
            if number is None or number < least or (most is not None and number > most):
                raise InputError(f"{name}: {value!r} was given; expected a whole number of {least} "
                                 + ("or more" if most is None else f"to {most}"))
        for name, spacing in (("resolution_mm", resolution_mm), ("route_spacing_mm", route_spacing_mm)):
            if not is_number(spacing) or not 0 < spacing <= 100:
                raise InputError(f"{name}: {spacing!r} was given; expected a number above 0, up to 100")
        self.stand = (stand,) if isinstance(stand, str) else tuple(stand) if isinstance(stand, (list, tuple)) else (stand,)
        if any(part not in tuple(STAND_SPEED) or self.stand.count(part) > 1 for part in self.stand):
            raise InputError(f"stand: {stand!r} was given; expected a list of these: " + ", ".join(STAND_SPEED))
        self.n = n
        self.image_size, self.points, self.spacing = image_size, n_points, resolution_mm
        self.route = (route_points, route_spacing_mm)
        self.physical, self.flat, self.reward = action == "physical", flat_action, reward
        self.most_steps, self.frames, self.patience, self.hashes = max_episode_steps, frame_skip, patience, hashes
        self.beam, self.render_mode = bool(beam), render_mode
        if set is not None and not isinstance(set, Mapping):
            raise InputError(f"set: {set!r} was given; expected a dict of keys and values")
        self.set, self.cache = dict(set or {}), cache
        self.scenario = scenario
        self.pool_size = pool_size
        self.pool: OrderedDict[Any, Simulation] = OrderedDict()
        self._checked_draws: dict[str, Draws] = {}
        self.randomize = randomize
        base = self._simulation(scenario, {})
        self.about = base.about()
        self.device_names: list[str] = self.about["device_names"]
        self.devices = len(self.device_names)
        self.step_s: float = frame_skip / self.about["frame_rate_hz"]
        self._check_branches(_branches(base))
        self.targets: dict[str, Tuple[str, float, Optional[str]]] = {}  # of scenarios as they are
        self.obs = self._checked_obs(obs)
        self.sim = VectorSimulation(base, n, threads=threads, points=n_points, spacing_mm=resolution_mm)
        self.names = [_branches(base)] * n
        self.drawn: list[dict[str, Any]] = [{} for _ in range(n)]
        self.rng = [np.random.default_rng() for _ in range(n)]
        self.episodes = np.zeros(n, np.int64)  # that are over
        self.all_steps = np.zeros(n, np.int64)  # in all episodes
        self.successes: list[deque[bool]] = [deque([], _REMEMBERED) for _ in range(n)]
        limits = np.concatenate([np.broadcast_to(SPEED, (self.devices, 2)),
                                 np.reshape([STAND_SPEED[part] for part in self.stand], (-1, 2))])
        self.speeds = limits
        self.high = (limits if self.physical else np.ones_like(limits)).astype(np.float32)
        high = self.high.reshape(-1) if flat_action else self.high
        self.action_space: Space = Box(-high, high)
        self.action_shape: Tuple[int, ...] = high.shape if alone else (n, *high.shape)
        self.observation_space = Dict({key: self._space(key) for key in self.obs})
        rows = (self.devices, n_points, 3)
        self.noise = [0] * n
        self.salt = np.zeros(n, np.uint64)
        self.steps = np.zeros(n, np.int64)
        self.restless = np.zeros(n, np.int64)
        self.last = np.zeros((n, *self.high.shape), np.float32)
        self.path = np.zeros(n)
        self.path_at_start = np.ones(n)
        self.track_before = np.zeros((n, n_points, 3))
        self.jitter = np.zeros((n, *rows))  # of what is tracked, in this step [mm]
        self.spread = np.zeros(n)  # standard deviation of that [mm]
        self.latency = np.zeros(n, np.int64)  # steps
        self.queue: list[list[Any]] = [[] for _ in range(n)]  # actions that wait
        self.done = np.ones(n, bool)  # the episode is over, or none was begun
        self.won = np.zeros(n, bool)
        self.moved_target = np.zeros(n, bool)

    def __getstate__(self) -> dict[str, Any]:
        return dict(self.__dict__, pool=OrderedDict(), _checked_draws={})

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        for like in self.sim.likes:
            self.pool[repr(like._made)] = like

    # Keys and spaces

    def _checked_obs(self, obs: Any) -> Tuple[str, ...]:
        of_device = [f"{device}_{part}" for device in self.device_names for part in OF_DEVICE]
        known = (*KEYS, *of_device)
        if obs is None:
            others = [f"{device}_tracking2d" for device in self.device_names if device != self.about["target_by"]]
            obs = ("tracking2d", "target2d", "rotation", *others)
        if not isinstance(obs, (str, Sequence)):
            raise InputError(f"obs: {obs!r} was given; expected a list of these: " + ", ".join(known))
        keys = (obs,) if isinstance(obs, str) else tuple(dict.fromkeys(obs))
        for key in keys:
            if key not in known:
                raise InputError(f"obs: '{key}' was found; expected " + ", ".join(known))
        if not keys:
            raise InputError("obs: nothing was given; expected one key or more: " + ", ".join(known))
        return keys

    def _space(self, key: str) -> Space:
        size, points, devices = self.image_size, self.points, self.devices
        if key in ("image", "guidewire", "phantom") or key.endswith("_mask"):
            return Box(0, 255, (size, size, 1), np.uint8)
        if key == "last_action":
            return Box(-self.high, self.high)
        if key == "rotation":
            return Box(-1, 1, (devices, 2))
        if key == "inserted_length":
            return Box(0, FAR, (devices,))
        if key == "force":
            return Box(0, FORCE, (2,))
        if key == "c_arm":
            return Box(-180, 180, (2,))
        kind = key.rpartition("_")[2] if key not in KEYS else key
        shapes = {"tracking2d": (points, 2), "tracking3d": (points, 3), "target2d": (2,), "target3d": (3,),
                  "tip2d": (devices, 2), "tip3d": (devices, 3), "joint_pos": (3 * points,), "joint_vel": (3 * points,),
                  "table": (3,), "route2d": (self.route[0], 2), "route3d": (self.route[0], 3)}
        far = 2.0 * size if kind.endswith("2d") else 100 * FAR if kind == "joint_vel" else FAR
        return Box(-far, far, shapes[kind])

    # Scenes

    @property
    def randomize(self) -> Any:
        return self._randomize

    @randomize.setter
    def randomize(self, ranges: Any) -> None:
        if not callable(ranges):
            self._draws({} if ranges is None else ranges)
        self._randomize = ranges

    def _draws(self, ranges: Any) -> Draws:
        """What was checked before is not checked anew, so that a curriculum costs nothing where it stays."""
        key = repr(ranges)
        if key not in self._checked_draws:
            self._checked_draws = {key: Draws(ranges, self.scenario, self.set)}
        return self._checked_draws[key]

    def _draws_of(self, i: int) -> Draws:
        if callable(self._randomize):
            return self._draws(self._randomize({
                "episodes": int(self.episodes[i]), "steps": int(self.all_steps[i]),
                "success_rate": sum(self.successes[i]) / max(1, len(self.successes[i]))}))
        return self._draws({} if self._randomize is None else self._randomize)

    def _check_branches(self, there: Sequence[str]) -> None:
        draws = self._draws({} if callable(self._randomize) or self._randomize is None else self._randomize)
        if not isinstance(draws.target, str) and "scenario" not in draws.ranges:
            _require_branches(draws.target, there)  # of other vessels it is found when they are drawn

    def _simulation(self, scenario: Any, values: Mapping[str, Any]) -> Simulation:
        arguments: dict[str, Any] = dict(set={**self.set, **values}, images="dose" if self.beam else False,
                                         panel=self.render_mode == "panel", cache=self.cache)
        key = repr(Simulation._arguments(scenario, **arguments))
        if key not in self.pool:
            self.pool[key] = Simulation(scenario, **arguments)
            if len(self.pool) > self.pool_size:
                self.pool.popitem(last=False)
        self.pool.move_to_end(key)
        return self.pool[key]

    def _target_of(self, scenario: Any) -> Tuple[str, float, Optional[str]]:
        """Of a scenario's own vessels: branch of its target, how far along that is [mm], the target with a name that is nearest."""
        key = repr(scenario)
        if key not in self.targets:
            sim = self._simulation(scenario, {})
            named = sim.anatomy()["targets"]
            away = [float(np.linalg.norm(one["centre_mm"] - sim.state.target_mm)) for one in named]
            self.targets[key] = (*_along_of_target(sim), named[int(np.argmin(away))]["name"] if named else None)
        return self.targets[key]

    def _drawn_simulation(self, scenario: Any, values: Mapping[str, Any]) -> Simulation:
        """Of other vessels, in which the scenario's place may be outside: its target is one with a name until _place() moves it."""
        named = self._target_of(scenario)[2] if _other_vessels(values) else None
        if named is None or any(key.startswith("target.") for key in (*values, *self.set)):
            return self._simulation(scenario, values)
        return self._simulation(scenario, {**values, "target.name": named})

    def _aim(self, i: int, target: Any) -> None:
        self.sim.aim(i, target)
        self.moved_target[i] = True

    def _place(self, i: int, sim: Simulation, wanted: Any, rng: np.random.Generator, own: Any) -> None:
        """Draws the target of the i-th simulation. own: the scenario whose target goes to the same branch of other vessels, or
        None."""
        if isinstance(wanted, str) and wanted == "scenario" and own is None:
            return
        anatomy = sim.anatomy()
        branches = {branch["name"]: branch for branch in anatomy["branches"]}
        if isinstance(wanted, str) and wanted == "targets":
            names = [target["name"] for target in anatomy["targets"]]
            if not names:
                raise InputError("randomize: target 'targets' was given, and these vessels name none; "
                                 "expected 'branches'")
            self._aim(i, names[int(rng.integers(len(names)))])
        elif isinstance(wanted, str) and wanted == "scenario":
            named, along, _ = self._target_of(own)
            if named in branches:
                self._aim(i, _at(branches[named], along))
        else:
            names = list(branches) if isinstance(wanted, str) else list(wanted)
            _require_branches(names, list(branches))
            branch = branches[names[int(rng.integers(len(names)))]]
            length = float(np.linalg.norm(np.diff(branch["points_mm"], axis=0), axis=1).sum())
            self._aim(i, _at(branch, float(rng.uniform(0.3, 0.9)) * length))

    def _asked_target(self, i: int, sim: Simulation, target: Any, rng: np.random.Generator) -> None:
        """That of reset's options: a target's name, a branch, in which a place is drawn, or a place."""
        if isinstance(target, str):
            anatomy = sim.anatomy()
            targets = [one["name"] for one in anatomy["targets"]]
            branches = [one["name"] for one in anatomy["branches"]]
            if target not in targets and target in branches:
                return self._place(i, sim, [target], rng, None)
            if target not in targets:
                raise InputError(f"options: target '{target}' was given; expected a place or one of "
                                 + ", ".join([*targets, *branches]))
        self._aim(i, target)

    def _scene(self, i: int, options: Mapping[str, Any]) -> None:
        rng, draws = self.rng[i], self._draws_of(i)
        start = options.get("start")
        asked = {**options.get("set", {}), **options.get("lengths", {})}
        for tried in range(1, _TRIES + 1):
            scenario = draws.scenario(self.scenario, rng)
            drawn = {**draws.values(rng, stand=False), **{key: asked[key] for key in asked if key not in STAND}}
            try:
                sim = self._drawn_simulation(scenario, drawn)
                break
            except InputError as error:  # wire or target of the scenario do not fit these vessels: others are drawn
                if not draws.change_the_scenario:
                    raise
                if tried == _TRIES:
                    raise InputError(f"randomize: none of {_TRIES} draws fits: {error}") from None
        if self.sim.likes[i] is not sim or self.moved_target[i]:
            self.sim.assign(i, sim)
            self.names[i] = _branches(sim)
            self.moved_target[i] = False
        else:
            one = np.zeros(self.n, bool)
            one[i] = True
            self.sim.reset(one)
        if "target" in options:
            self._asked_target(i, sim, options["target"], rng)
        else:
            self._place(i, sim, draws.target, rng,
                        scenario if _other_vessels(drawn) else None)
        if isinstance(start, EnvSnapshot):
            if "target" in options or "set" in options:
                raise InputError("options: a snapshot as start was given with target or set; expected it alone, as it has both")
            self._take(i, start)
            scenario, drawn = start.drawn.get("scenario", self.scenario), dict(start.drawn)
        turned = {**draws.values(rng, stand=True), **{key: asked[key] for key in asked if key in STAND}}
        if turned:
            lao, cranial = (turned.get(key, now) for key, now in zip(STAND, self.sim.c_arm_deg[i]))
            self.sim.apply(i, f"arm lao {np.clip(lao, -120, 120):.6f} deg cranial {np.clip(cranial, -45, 45):.6f} deg")
        if self.beam:
            self.sim.apply(i, "beam on")
        self.latency[i], self.spread[i] = draws.own("latency_steps", rng), draws.own("tracking_noise_mm", rng)
        self.queue[i] = [np.zeros(self.high.shape, np.float32)] * int(self.latency[i])
        self.noise[i] = int(rng.integers(2 ** 53))
        self.drawn[i] = {**drawn, **turned, "scenario": scenario, "latency_steps": int(self.latency[i]),
                         "tracking_noise_mm": float(self.spread[i])}
        text = json.dumps([self.drawn[i], self.noise[i]], sort_keys=True, default=str)
        self.salt[i] = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")
        pixels = self.about["pixels"]
        if not (0 <= self.sim.tip_px[i].min() and self.sim.tip_px[i].max() < pixels):
            self.sim.show_tip(i)

    def _shake(self, which: Flags) -> None:
        for i in map(int, np.flatnonzero(which & (self.spread > 0))):
            self.jitter[i] = self.rng[i].normal(0, self.spread[i], self.jitter.shape[1:])

    def way(self) -> Floats:
        """(n,) mm: along centrelines to the target, straight where there is no way."""
        path = self.sim.path_to_target_mm
        return np.where(np.isnan(path), self.sim.tip_to_target_mm, path)

    # The contract

    def require_open(self) -> None:
        if self.sim.closed:
            raise InputError("the environment is closed; expected one that is open")

    def close(self) -> None:
        self.sim.close()
        self.pool.clear()

    def options(self, given: Any, more: Sequence[str] = ()) -> dict[str, Any]:
        """Options of a reset, checked."""
        known = (*more, *OPTIONS)
        if given is None:
            return {}
        if not isinstance(given, Mapping):
            raise InputError(f"options: {given!r} was given; expected a dict of " + ", ".join(known))
        for key in given:
            if key not in known:
                raise InputError(f"options: {key!r} was found; expected " + ", ".join(known))
        if not isinstance(given.get("set", {}), Mapping):
            raise InputError(f"options: set {given['set']!r} was given; expected a dict of a scenario's keys and values")
        checked_seed(given.get("seed"))
        values = dict(given.get("set", {}))
        if values:
            checked_values("options: set", self.scenario, self.set, values)
        return dict(given, lengths=self._lengths(given.get("start"), values))

    def _lengths(self, start: Any, values: Mapping[str, Any]) -> dict[str, float]:
        """Keys of the scenario for lengths inside at the start: of the wire, or by device. None for a snapshot."""
        if start is None or isinstance(start, EnvSnapshot):
            return {}
        lengths = {"wire": start} if is_number(start) else start
        if not isinstance(lengths, Mapping) or not all(is_number(length) for length in lengths.values()):
            raise InputError(f"options: start {start!r} was given; expected the wire's length inside [mm], a dict of those of "
                             "devices, or a snapshot of an environment")
        for device in lengths:
            if device not in self.device_names:
                raise InputError(f"options: start of {device!r} was given; expected " + ", ".join(self.device_names))
        # A scenario has the wire's in one of two sections.
        for wire in ("guidewire", "entry"):
            made = {(wire if device == "wire" else device) + ".inserted_mm": float(length) for device, length in lengths.items()}
            try:
                checked_values("options: start", self.scenario, self.set, {**values, **made})
                break
            except InputError:
                if wire == "entry":
                    raise
        return made

    def reset(self, which: Flags, seeds: Sequence[Optional[int]], options: Mapping[str, Any] = {}) -> None:
        self.done[which] = True  # until all is drawn
        for i in map(int, np.flatnonzero(which)):
            seed = seeds[i]
            if seed is not None:
                self.rng[i] = np.random.default_rng(seed)
            if self.steps[i] > 0:
                self.episodes[i] += 1
                self.successes[i].append(bool(self.won[i]))
            self.steps[i] = 0
            self._scene(i, options)
        self.jitter[which] = 0
        self._shake(which)
        self.restless[which] = 0
        self.done[which] = self.won[which] = False
        self.last[which] = 0
        way = self.way()
        self.path[which] = way[which]
        self.path_at_start[which] = np.maximum(way[which], 1e-9)
        self.track_before[which] = self.sim.track_mm[which]

    def snapshot(self, i: int) -> EnvSnapshot:
        self.require_open()
        own = {name: getattr(self, name)[i] for name in self._OWN}
        own = {name: value.copy() if isinstance(value, (np.ndarray, list)) else value for name, value in own.items()}
        return EnvSnapshot(self.sim.likes[i], self.sim._target(i), self.sim.snapshot(i), dict(self.drawn[i]), self.names[i],
                           self.rng[i].bit_generator.state, own)

    def _take(self, i: int, kept: EnvSnapshot) -> None:
        """The simulation's part of a snapshot."""
        moved = self.sim.likes[i] is not kept.like
        if moved:
            about = kept.like.about()
            for key in ("device_names", "frame_rate_hz", "pixels"):
                if about[key] != self.about[key]:
                    raise InputError(f"a snapshot of an environment with {key} {about[key]} was given; expected "
                                     f"{self.about[key]}")
            self.sim.assign(i, kept.like)
        if moved or not same_target(self.sim._target(i), kept.target):
            self.sim.aim(i, **_aim(kept.target))
        self.sim.restore(i, kept.simulation)
        self.names[i], self.drawn[i], self.moved_target[i] = list(kept.names), dict(kept.drawn), True

    def restore(self, i: int, kept: Any) -> None:
        self.require_open()
        if not isinstance(kept, EnvSnapshot):
            raise InputError(f"snapshot: {kept!r} was given; expected one of an environment's snapshot()")
        for name in ("last", "track_before", "jitter"):
            if kept.own[name].shape != getattr(self, name)[i].shape:
                raise InputError("a snapshot of an environment with other devices, stand or n_points was given; expected one "
                                 "with the same")
        self._take(i, kept)
        for name, value in kept.own.items():
            getattr(self, name)[i] = list(value) if isinstance(value, list) else value
        self.rng[i].bit_generator.state = kept.rng

    def numbers(self, actions: Any, active: Optional[Flags] = None) -> NDArray[np.float32]:
        """Actions as (n, rows, 2). Raises InputError for another shape and numbers that are not finite, of those active."""
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
        given = given.reshape(self.n, *self.high.shape)
        if not np.isfinite(given if active is None else given[active]).all():
            raise InputError("action: a number that is not finite was given; expected finite ones")
        return given

    def checked(self, actions: Any, active: Flags) -> NDArray[np.float32]:
        """The same within the space, 0 where not active."""
        return np.clip(np.where(active[:, None, None], self.numbers(actions, active), np.float32(0)), -self.high, self.high)

    def act(self, given: NDArray[np.float32], active: Flags) -> None:
        """Makes a step of what checked() returned."""
        self.track_before[active] = self.sim.track_mm[active]
        self.last[active] = given[active]
        for i in map(int, np.flatnonzero((self.latency > 0) & active)):
            self.queue[i].append(given[i])
            given = given.copy()
            given[i] = self.queue[i].pop(0)
        speed = given.astype(np.float64) * (1.0 if self.physical else self.speeds)
        count = self.devices
        for k, part in enumerate(self.stand):
            for i in map(int, np.flatnonzero(active)):
                self._move_stand(i, part, speed[i, count + k] * self.step_s)
        self.sim.step(speed[:, :count] * (self.step_s / self.frames), frames=self.frames, active=active)
        self.steps[active] += 1
        self.all_steps[active] += 1
        self._shake(active)
        restless = ~self.sim.at_rest | self.sim.refused
        self.restless = np.where(active, np.where(restless, self.restless + 1, 0), self.restless)

    def _move_stand(self, i: int, part: str, by: Floats) -> None:
        if not by.any():
            return
        if part == "c_arm":
            lao, cranial = np.clip(self.sim.c_arm_deg[i] + by, (-120, -45), (120, 45))
            self.sim.apply(i, f"arm lao {lao:.6f} deg cranial {cranial:.6f} deg")
        else:
            x, y, z = np.clip(self.sim.table_mm[i] + (by[0], 0, by[1]), -REACH, REACH)
            self.sim.apply(i, f"table {x:.6f} {y:.6f} {z:.6f} mm")

    def observe(self) -> dict[str, NDArray[Any]]:
        """Arrays of shape (n, …), new ones."""
        sim, made = self.sim, {}
        masks: dict[str, NDArray[np.uint8]] = {}
        for key in self.obs:
            if key == "image":
                made[key] = sim.images(self.image_size, seeds=self.noise)[..., None]
            elif key in ("guidewire", "phantom") or key.endswith("_mask"):
                masks = masks or sim.masks(self.image_size)
                of = {"guidewire": "wire", "phantom": "vessels"}.get(key, key[:-len("_mask")])
                made[key] = masks[of][..., None]
            else:
                space = self.observation_space[key]
                made[key] = np.clip(self._numbers_of(key), space.low, space.high).astype(np.float32)
        return made

    def _numbers_of(self, key: str) -> Any:
        sim = self.sim
        device, _, kind = key.rpartition("_")
        if kind not in OF_DEVICE or device not in self.device_names:
            device, kind = self.about["target_by"], key
        k = self.device_names.index(device)
        scale = self.image_size / self.about["pixels"]
        shaken = self.jitter[..., :2] * (self.about["pixels"] / self.about["field_mm"])
        if kind == "tracking2d":
            return (sim.tracks_px[:, k] + shaken[:, k]) * scale
        if kind == "tracking3d":
            return sim.tracks_mm[:, k] + self.jitter[:, k]
        if kind == "tip2d":
            return (sim.tracks_px[:, :, 0] + shaken[:, :, 0]) * scale
        if kind == "tip3d":
            return sim.tracks_mm[:, :, 0] + self.jitter[:, :, 0]
        if kind == "route2d":
            return sim.route(*self.route)[1] * scale
        if kind == "route3d":
            return sim.route(*self.route)[0]
        if kind == "target2d":
            return sim.target_px * scale
        if kind == "target3d":
            return sim.target_mm
        if kind == "inserted_length":
            return sim.inserted_mm[:, :self.devices]
        if kind == "rotation":
            turned = np.radians(sim.turned_deg[:, :self.devices])
            return np.stack([np.sin(turned), np.cos(turned)], -1)
        if kind == "last_action":
            return self.last
        if kind == "force":
            return np.stack([sim.tip_force_N, sim.wall_force_N], -1)
        if kind == "c_arm":
            return sim.c_arm_deg
        if kind == "table":
            return sim.table_mm
        if kind == "joint_pos":
            return sim.track_mm.reshape(self.n, -1)
        return (sim.track_mm - self.track_before).reshape(self.n, -1) / self.step_s

    def render(self) -> Optional[Tuple[NDArray[np.uint8], ...]]:
        if self.render_mode is None:
            return None
        self.require_open()
        if self.render_mode == "panel":
            return tuple(self.sim.panel(i, seed=self.noise[i]) for i in range(self.n))
        return tuple(np.repeat(self.sim.images(self.image_size, seeds=self.noise)[..., None], 3, -1))

    def judge(self, active: Flags) -> Tuple[Floats, Flags, Flags, dict[str, Any]]:
        """Rewards, terminated, truncated and infos, arrays of n."""
        sim = self.sim
        way = self.way()
        reached = sim.on_target & active
        over = np.zeros(self.n, bool) if self.most_steps is None else self.steps >= self.most_steps
        reasons = {"not_certified": self.restless >= self.patience, "vessel_end": sim.past_vessel_end,
                   "time": sim.time_is_up, "steps": over}
        why = np.full(self.n, None, object)
        for name, holds in reasons.items():
            why[holds & active & ~reached] = name
        truncated = np.array([reason is not None for reason in why])

        def of_each(array: Floats) -> dict[str, Floats]:
            return {device: array[:, k].copy() for k, device in enumerate(self.device_names)}
        info: dict[str, Any] = {
            "success": reached.copy(), "truncation": why, "branch": np.array(
                [self.names[i][b] for i, b in enumerate(sim.branch)], object),
            "path_ratio": way / self.path_at_start, "path_to_target_mm": way,
            "tip_to_target_mm": sim.tip_to_target_mm.copy(), "tip_force_N": sim.tip_force_N.copy(),
            "wall_force_N": sim.wall_force_N.copy(), "inserted_mm": of_each(sim.inserted_mm), "push_N": of_each(sim.push_N),
            "torque_Nmm": of_each(sim.torque_Nmm), "certified": sim.certified.copy(), "time_s": sim.time_s.copy(),
            "dose": {"air_kerma_mGy": sim.air_kerma_mGy.copy(), "area_product_Gycm2": sim.area_product_Gycm2.copy()}}
        if self.hashes:
            # Signed: gymnasium puts whole numbers together as int64, and tensors and JSON hold no more.
            info["hash"] = (sim.hashes(asked=True) ^ self.salt).view(np.int64)
        parts: dict[str, Any]
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
        self.done = np.where(active, reached | truncated, self.done)
        self.won = np.where(active, reached, self.won)
        return sum(parts.values()), reached, truncated, info


    def begin_next(self) -> Tuple[Flags, NDArray[Any], dict[str, Any]]:
        """Begins the next episodes of those that are over, which done says: (which, (n,) last observation of each of them or
        None, first infos of all)."""
        ended, last = self.done.copy(), self.observe()
        finals = np.full(self.n, None, object)
        for i in np.flatnonzero(ended):
            finals[i] = {key: value[i].copy() for key, value in last.items()}
        self.reset(ended, [None] * self.n)
        return ended, finals, self.judge(np.zeros(self.n, bool))[3]


def _branches(sim: Simulation) -> list[str]:
    return [branch["name"] for branch in sim.anatomy()["branches"]]


def _require_branches(names: Sequence[str], there: Sequence[str]) -> None:
    for name in names:
        if name not in there:
            raise InputError(f"randomize: target branch '{name}' was given; expected " + ", ".join(there))


def _along_of_target(sim: Simulation) -> Tuple[str, float]:
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


def _other_vessels(drawn: Mapping[str, Any]) -> bool:
    return any(key.startswith("anatomy") for key in drawn)


def _at(branch: Mapping[str, Any], along: float) -> Floats:
    """The place so far along a branch [mm]."""
    points: Floats = branch["points_mm"]
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    place: Floats = points[int(np.abs(ways - min(along, 0.95 * ways[-1])).argmin())]
    return place


def one(info: Mapping[str, Any], i: int) -> dict[str, Any]:
    """The info of one environment."""
    return {key: {name: float(part[i]) for name, part in value.items()} if isinstance(value, dict)
            else value[i].item() if isinstance(value[i], np.generic) else value[i] for key, value in info.items()}


def with_masks(info: Mapping[str, Any], given: Flags) -> dict[str, Any]:
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
