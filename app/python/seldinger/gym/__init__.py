"""Environments by the contract of gymnasium: reset(*, seed, options) -> (observation, info) and step(action) ->
(observation, reward, terminated, truncated, info). They need NumPy alone. Where gymnasium can be imported, Env and
VectorEnv are its subclasses, spaces are its own, and gymnasium.make("seldinger.gym:seldinger/Renal-v1") makes them, too.

    env = sd.gym.make("seldinger/Renal-v1", obs=("tracking2d", "target2d", "image"), image_size=128)
    observation, info = env.reset(seed=7)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Callable, Dict, Mapping, Optional, Tuple, TypeVar

import numpy as np

from .._arrays import NDArray
from .. import _core
from .._core import InputError
from ..simulation import VectorSimulation
from . import spaces
from .batch import KEYS, Batch, EnvSnapshot, checked_seed, one, with_masks
from .draws import whole

__all__ = ["AUTORESET", "COARSE", "ENVIRONMENTS", "Env", "EnvSnapshot", "KEYS", "VectorEnv", "check_env", "make", "make_vec", "spaces"]

MAX_EPISODE_STEPS = 300
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "seldinger/Renal-v1": {"scenario": "renal"},
    "seldinger/Carotid-v1": {"scenario": "carotid_vertebral"},
    "seldinger/Coronary-v1": {"scenario": "coronary"},
    "seldinger/Crossover-v1": {"scenario": "crossover"},
    # Arches of type I, II and III, each with a catheter over the wire.
    "seldinger/ArchVariety-v1": {"scenario": "carotid_vertebral",
                                 "randomize": {"scenario": ("carotid_vertebral", "arch_2", "arch_3")}},
    "seldinger/DualDevice-v1": {"scenario": "renal_cobra"},
}
"""Environments that make() knows, and the arguments that each has of its own."""

COARSE: dict[str, Any] = {"tissue.rigid": True, "chain.segment_length_mm": 4.0}
"""Keys for `set` that make training two to three times as fast: vessels stay where they are, and segments are about twice as
long. What is learned so holds in the exercise as it is: the solutions of all environments reach their targets both ways, and
end with their tips 0.1 to 1.2 mm apart (docs/python/environments.md)."""

AUTORESET = ("NEXT_STEP", "SAME_STEP", "DISABLED")

Observation = Dict[str, NDArray[Any]]
Info = Dict[str, Any]

if TYPE_CHECKING:
    class _Env:
        def reset(self, *, seed: Optional[int], options: Any) -> Any: ...

    class _VectorEnv: ...
elif spaces.gymnasium:
    _Env, _VectorEnv = spaces.gymnasium.Env, spaces.gymnasium.vector.VectorEnv
else:
    class _Env:
        def reset(self, *, seed, options): ...
    _VectorEnv = object


_Init = TypeVar("_Init", bound=Callable[..., None])


def _with_arguments(init: _Init) -> _Init:
    """Shows Batch's arguments, which a constructor passes on, as its own."""
    own = [p for p in inspect.signature(init).parameters.values() if p.kind is not p.VAR_KEYWORD]
    more = [p for p in inspect.signature(Batch).parameters.values()
            if p.kind is p.KEYWORD_ONLY and p.name != "threads"]
    setattr(init, "__signature__", inspect.Signature(own + more))
    return init


class _OfBatch:
    """What all that stand on a Batch have."""

    _batch: Batch
    spec: Any = None

    @property
    def simulation(self) -> VectorSimulation:
        """The simulations, one for each environment, for score(i), save(i, path), hashes(). Their snapshots are not the
        environments', which have their own."""
        return self._batch.sim

    @property
    def randomize(self) -> Any:
        """What resets draw; may be set."""
        return self._batch.randomize

    @randomize.setter
    def randomize(self, ranges: Any) -> None:
        self._batch.randomize = ranges

    def __repr__(self) -> str:
        batch = self._batch
        name = self.spec.id if self.spec is not None else batch.about["name"]
        count = "" if isinstance(self, Env) else f" x {batch.n}"
        state = ", closed" if batch.sim.closed else ""
        return f"<{type(self).__name__} {name}{count}: obs {', '.join(batch.obs)}; actions {batch.action_space.shape}{state}>"

    __str__ = __repr__

    def close(self) -> None:
        """Frees the simulations."""
        self._batch.close()


class _OfSeveral(_OfBatch):
    num_envs: int

    def snapshot(self, i: int) -> EnvSnapshot:
        """That of the i-th environment, as Env.snapshot."""
        return self._batch.snapshot(self._index(i))

    def restore(self, i: int, snapshot: EnvSnapshot) -> None:
        """Takes the i-th environment to a snapshot, of any of these or of an Env with the same arguments."""
        self._batch.restore(self._index(i), snapshot)

    def _index(self, i: int) -> int:
        number = whole(i)
        if number is None or not 0 <= number < self.num_envs:
            raise IndexError(f"environment {i!r} of {self.num_envs}")
        return number


class Env(_OfBatch, _Env):
    """One environment.

    scenario           as for seldinger.Simulation
    obs                key or keys of the observation, a dict of float32 arrays with finite bounds (values beyond are clipped):
        tracking2d (n_points, 2), target2d (2,)      in pixels of an image of image_size; points from the tip backward,
        tracking3d (n_points, 3), target3d (3,)      and mm: of the device whose tip must reach the target
        DEVICE_tracking2d, DEVICE_tracking3d         of the device of that name: wire_tracking2d, catheter_tracking2d
        tip2d (n_devices, 2), tip3d (n_devices, 3)   tips of all devices, innermost first, as all that has n_devices
        inserted_length (n_devices,) mm; rotation (n_devices, 2): sine and cosine of the hub; last_action
        joint_pos (3 n_points,) mm, joint_vel (3 n_points,) mm/s: of the tracked points; force (2,): of tip, largest [N]
        route2d (route_points, 2), route3d (route_points, 3)   points on the way to the target along centrelines, ahead of that
                       device's tip, route_spacing_mm apart; the last is repeated where the way ends
        c_arm (2,): LAO and cranial [deg]; table (3,) mm: how far it has moved to the left, back and head of the patient
        image, guidewire, phantom (image_size, image_size, 1) uint8: an X-ray image, masks of wire and vessels
        DEVICE_mask (image_size, image_size, 1) uint8: of the device of that name
                       By default tracking2d, target2d, rotation, and DEVICE_tracking2d of each other device
    image_size         pixels along a side, 32 to 2048
    n_points, resolution_mm   how many points are tracked, and how far apart; all at the introducer for a device that is out
    action             'velocity': Box(-1, 1, (n_devices, 2)), times 35 mm/s and 3.14 rad/s; 'physical': mm/s and rad/s.
                       Rows are the devices, innermost first: wire, catheter
    stand              'c_arm', 'table' or both: a row more for each, LAO and cranial (times 20 deg/s), to the patient's left
                       and head (times 100 mm/s)
    flat_action        one dimension instead
    reward             'path_delta': 0.01 a mm nearer along the vessels, 1 at the target, -0.001 a step
                       'distance': -0.001 a mm of straight distance each step, 10 at the target
                       'sparse': 1 at the target; or a callable of the info that returns a finite number
    max_episode_steps  steps to truncation; None: no limit. An environment of gymnasium.make() leaves it to TimeLimit
    frame_skip         frames a step, 1 to 1000000; the scenario's frame_rate_hz is usually 15
    patience           steps in a row without a rest of the wire, or with a motion refused, to truncation
    randomize          what each reset draws: a dict of keys of the scenario ('guidewire.friction', 'anatomy.seed') with a
                       range (low, high), of whole numbers of seeds (first, end); of arrays two lists; or a list of choices, in
                       which dicts may have ranges; or a callable of a numpy.random.Generator. Besides: 'target': 'branches' (any
                       place in any branch), 'targets' (those named), or a list of branches; 'scenario': a scenario or a list
                       of them, with as many devices, frames a second and pixels as the one above; 'latency_steps': steps
                       that actions wait, a range of whole numbers; 'tracking_noise_mm': standard deviation of what is
                       tracked and of tips.
                       A curriculum is a callable that returns such a dict for the next episode; it takes a dict of
                       'episodes', 'steps' so far and 'success_rate' of the last 100. The attribute randomize may be set
    set                values in place of the scenario's, as for Simulation
    cache              as for Simulation
    hashes             whether info has a hash
    pool_size          scenes that are kept in memory
    beam               whether the foot is on the pedal in every frame, and dose is measured; images need no beam
    render_mode        'rgb_array': the image; 'panel': the room's panel around it, with readouts; or None

    At the start of an episode the tip is in the image; the table is moved where it is not.
    terminated: the tip is within the target's radius. truncated: info['truncation'] is 'steps', 'time' (the scenario's
    limit), 'vessel_end' (the tip is past an end of the vessels) or 'not_certified' (see patience), else None.
    info: success, truncation, branch, path_ratio (way left over that at the start), path_to_target_mm, tip_to_target_mm,
    tip_force_N, wall_force_N, certified, time_s; inserted_mm, push_N and torque_Nmm (dicts by device); reward (its parts),
    dose (a dict of air_kerma_mGy and area_product_Gycm2 of the episode, 0 without beam), hash (of the state, the target, what
    was drawn and the stand: a signed int of 64 bits). All are numbers, texts, None and dicts of them, which JSON takes.
    The attribute drawn has what the last reset drew. Environments may be copied by copy.deepcopy and pickled.
    Raises InputError for arguments that are not accepted, and after close().
    """

    metadata: Dict[str, Any] = {"render_modes": ["rgb_array", "panel"], "render_fps": 15}

    @_with_arguments
    def __init__(self, scenario: Any = "renal", **arguments: Any) -> None:
        self._batch = Batch(scenario, None, threads=1, **arguments)
        self.render_mode = self._batch.render_mode
        self.metadata = _metadata(self)
        self.action_space = self._batch.action_space
        self.observation_space = self._batch.observation_space
        self._limit = self._batch.most_steps

    @property
    def drawn(self) -> Dict[str, Any]:
        """What the last reset drew, by key; 'scenario', 'latency_steps' and 'tracking_noise_mm' always."""
        return dict(self._batch.drawn[0])

    def reset(self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None) -> Tuple[Observation, Info]:
        """Begins an episode and returns (observation, info). All that is drawn, now and in later resets, follows from
        the seed, a whole number of 0 or more: the same seed gives the same states, to the bit, on every machine. Without
        one, drawing goes on.

        options, a dict of any of these, holds for this episode and goes before what is drawn:
            target   the name of a target, a branch, in which a place is drawn, or a place (3,) [mm]
            start    length of the wire inside [mm], a dict of those by device, or an EnvSnapshot to begin from
            set      a dict of keys of the scenario and values
            seed     as the argument, for wrappers that pass options alone
        Raises InputError for others."""
        given = self._batch.options(options)
        seed = checked_seed(seed)
        if seed is None:
            seed = checked_seed(given.get("seed"))
        self._batch.require_open()
        super().reset(seed=seed, options=options)
        self._batch.most_steps = None if self.spec is not None else self._limit
        self._batch.reset(np.ones(1, bool), [seed], given)
        return self._seen()

    def step(self, action: Any) -> Tuple[Observation, float, bool, bool, Info]:
        """Makes a step and returns (observation, reward, terminated, truncated, info). Actions beyond the space are
        clipped. Raises InputError for another shape, numbers that are not finite, and after the end of an episode."""
        self._batch.require_open()
        if self._batch.done[0]:
            raise InputError("the episode is over, or none was begun; expected reset()")
        active = np.ones(1, bool)
        self._batch.act(self._batch.checked(action, active), active)
        reward, terminated, truncated, info = self._batch.judge(active)
        return (_first(self._batch.observe()), float(reward[0]), bool(terminated[0]), bool(truncated[0]), one(info, 0))

    def snapshot(self) -> EnvSnapshot:
        """The whole state: of the simulation, the episode and the random stream. From restore() on the same actions give the
        same observations, rewards, ends and draws, to the bit."""
        return self._batch.snapshot(0)

    def restore(self, snapshot: EnvSnapshot) -> Tuple[Observation, Info]:
        """Goes back to a snapshot, of this environment or of another with the same arguments, and returns (observation,
        info) of it. Wrappers have states of their own, such as TimeLimit's count. Raises InputError for another's."""
        self._batch.restore(0, snapshot)
        return self._seen()

    def _seen(self) -> Tuple[Observation, Info]:
        return _first(self._batch.observe()), one(self._batch.judge(np.zeros(1, bool))[3], 0)

    def render(self) -> Optional[NDArray[np.uint8]]:
        """(image_size, image_size, 3) uint8 with render_mode='rgb_array', (1024, 1280, 3) with 'panel', else None."""
        frames = self._batch.render()
        return None if frames is None else frames[0]

    def _repr_png_(self) -> bytes:
        """The image, for notebooks."""
        self._batch.require_open()
        return _core._png(self._batch.sim.images(max(self._batch.image_size, 256), seeds=self._batch.noise)[0])


def _metadata(env: Any) -> Dict[str, Any]:
    """Frames that are rendered come once a step."""
    rate = 1 / env._batch.step_s
    return dict(type(env).metadata, render_fps=round(rate) if abs(rate - round(rate)) < 1e-9 else rate)


def _first(observation: Observation) -> Observation:
    return {key: value[0] for key, value in observation.items()}


class VectorEnv(_OfSeveral, _VectorEnv):
    """num_envs environments that step at once, on `threads` threads (by default one for each core; results do not depend on
    it). Other arguments are those of Env. Observations are dicts of (n, …) arrays; rewards, terminated and truncated are
    arrays of n. info is as gymnasium's: under each key an array of n, or a dict of such where Env has a dict, and beside
    each key '_key', (n,) bool: whose values these are; others are 0 or None.

    autoreset   one of gymnasium's AutoresetMode or its name.
                'NEXT_STEP': the step after an episode's end begins the next one; its action is not used, its reward 0.
                'SAME_STEP': the step that ends an episode returns the first observation and info of the next, but for
                info['reward'], the parts of this step's; the last observation is in info['final_obs'][i], and the last
                infos, put together as info is, in info['final_info'], for the i in '_final_obs' and '_final_info'.
                'DISABLED': reset(options={'reset_mask': (n,) bool}) begins the next; a step for an environment that has
                ended raises InputError.
    """

    metadata: Dict[str, Any] = {"render_modes": ["rgb_array", "panel"], "render_fps": 15, "autoreset_mode": "NEXT_STEP"}

    @_with_arguments
    def __init__(self, scenario: Any = "renal", num_envs: int = 1, *, threads: Optional[int] = None,
                 autoreset: Any = "NEXT_STEP", **arguments: Any) -> None:
        name = getattr(autoreset, "name", autoreset)
        if name not in AUTORESET:
            raise InputError(f"autoreset: {autoreset!r} was given; expected " + ", ".join(AUTORESET))
        if whole(num_envs) is None:
            raise InputError(f"num_envs: {num_envs!r} was given; expected a whole number of 1 to 100000")
        self.autoreset = name
        self._batch = Batch(scenario, num_envs, threads=threads, **arguments)
        self.num_envs = num_envs
        self.render_mode = self._batch.render_mode
        self.metadata = dict(_metadata(self), autoreset_mode=spaces.gymnasium.vector.AutoresetMode[name]
                             if spaces.gymnasium and hasattr(spaces.gymnasium.vector, "AutoresetMode") else name)
        self.single_action_space = self._batch.action_space
        self.single_observation_space = self._batch.observation_space
        self.action_space = spaces.batched(self.single_action_space, num_envs)
        self.observation_space = spaces.batched(self.single_observation_space, num_envs)
        self._begun = False

    @property
    def drawn(self) -> Tuple[Dict[str, Any], ...]:
        """What the last reset of each drew."""
        return tuple(map(dict, self._batch.drawn))

    def reset(self, *, seed: Any = None, options: Optional[Mapping[str, Any]] = None) -> Tuple[Observation, Info]:
        """Begins episodes and returns (observations, infos). seed: a number, of which the i-th environment takes
        seed + i, or a list of n numbers or None. options: those of Env.reset, for each, and 'reset_mask', (n,) bool, for
        some alone."""
        n = self.num_envs
        given = self._batch.options(options, ("reset_mask",))
        seed = given.get("seed") if seed is None else seed
        if seed is None or whole(seed) is not None:
            first = checked_seed(seed)
            seeds = [None if first is None else first + i for i in range(n)]
        elif isinstance(seed, (list, tuple, np.ndarray)) and np.ndim(seed) == 1:
            seeds = [checked_seed(one) for one in seed]
        else:
            raise InputError(f"seed: {seed!r} was given; expected a whole number or a list of {n} of them")
        if len(seeds) != n:
            raise InputError(f"seed: {len(seeds)} were given; expected a number or {n} of them")
        mask = np.asarray(given.get("reset_mask", np.ones(n, bool)))
        if mask.shape != (n,) or mask.dtype != bool:
            raise InputError(f"options: reset_mask of {mask.dtype} and shape {mask.shape} was given; expected a mask, an "
                             f"array of {n} truth values")
        self._batch.require_open()
        self._batch.reset(mask, seeds, given)
        self._begun = True
        return self._batch.observe(), with_masks(self._batch.judge(np.zeros(n, bool))[3], mask)

    def step(self, actions: Any) -> Tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Makes a step of each and returns (observations, rewards, terminated, truncated, infos)."""
        n, batch = self.num_envs, self._batch
        batch.require_open()
        if not self._begun or (self.autoreset == "DISABLED" and batch.done.any()):
            raise InputError("an episode is over, or none was begun; expected reset()")
        again = batch.done.copy()
        active = ~again
        given = batch.checked(actions, active)
        if again.any():
            batch.reset(again, [None] * n)
        batch.act(given, active)
        reward, terminated, truncated, info = batch.judge(active)
        all_of_them = np.ones(n, bool)
        if self.autoreset != "SAME_STEP" or not batch.done.any():
            return batch.observe(), reward, terminated, truncated, with_masks(info, all_of_them)
        ended, finals, first = batch.begin_next()
        final, info = with_masks(info, ended), dict(first, reward=info["reward"])
        return batch.observe(), reward, terminated, truncated, dict(
            with_masks(info, all_of_them), final_obs=finals, _final_obs=ended, final_info=final, _final_info=ended.copy())

    def render(self) -> Optional[Tuple[NDArray[np.uint8], ...]]:
        """Env.render of each."""
        return self._batch.render()

    def close(self, **_: Any) -> None:  # gymnasium's has arguments
        """Frees the simulations."""
        super().close()


def _arguments(name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    if name not in ENVIRONMENTS:
        raise InputError(f"'{name}': no such environment; expected " + ", ".join(ENVIRONMENTS))
    own = dict(ENVIRONMENTS[name])
    if "randomize" in own and isinstance(given.get("randomize"), Mapping):
        given = dict(given, randomize=dict(own["randomize"], **given["randomize"]))
    own.update(given)
    return own


def make(name: str, **arguments: Any) -> Env:
    """The environment of that name, one of ENVIRONMENTS. Arguments are those of Env."""
    return Env(**_arguments(name, arguments))


def make_vec(name: str, num_envs: int, **arguments: Any) -> VectorEnv:
    """So many environments of that name at once. Arguments are those of VectorEnv."""
    return VectorEnv(num_envs=num_envs, **_arguments(name, arguments))


def check_env(env: Env, seed: int = 0, steps: int = 10) -> None:
    """Checks the contract: spaces, 5-tuples, dtypes, bounds, and that a seed gives the same episode. Raises
    AssertionError with what is wrong."""
    def follow() -> list[Tuple[Observation, Any]]:
        env.action_space.seed(seed)
        observation, info = env.reset(seed=seed)
        assert isinstance(info, dict), "info is no dict"
        made: list[Tuple[Observation, Any]] = [(observation, info.get("hash"))]
        for _ in range(steps):
            action = env.action_space.sample()
            assert env.action_space.contains(action), "a sample lies outside the action space"
            result = env.step(action)
            assert isinstance(result, tuple) and len(result) == 5, "step returns no 5-tuple"
            observation, reward, terminated, truncated, info = result
            assert isinstance(reward, float) and np.isfinite(reward), f"reward {reward!r} is no finite float"
            assert isinstance(terminated, bool) and isinstance(truncated, bool), "an end is no bool"
            assert (info["truncation"] is not None) == truncated, "truncation and its reason disagree"
            assert info["success"] == terminated, "success and terminated disagree"
            assert np.isclose(sum(info["reward"].values()), reward), "the parts are not the reward"
            made.append((observation, info.get("hash")))
            if terminated or truncated:
                break
        return made

    first = follow()
    for observation, _ in first:
        for key, space in env.observation_space.spaces.items():
            value = observation[key]
            assert value.dtype == space.dtype, f"{key} is {value.dtype}, not {space.dtype}"
            assert value.shape == space.shape, f"{key} has the shape {value.shape}, not {space.shape}"
            assert np.isfinite(space.low).all() and np.isfinite(space.high).all(), f"{key} has an infinite bound"
            assert space.contains(value), f"{key} lies outside its space"
        assert set(observation) == set(env.observation_space.spaces), "other keys than the space's"
    second = follow()
    assert len(first) == len(second), "the same seed gave an episode of another length"
    for (a, hash_a), (b, hash_b) in zip(first, second):
        assert hash_a == hash_b, "the same seed gave another state"
        for key in a:
            assert np.array_equal(a[key], b[key]), f"the same seed gave another {key}"


if spaces.gymnasium:
    for _name in ENVIRONMENTS:
        if _name not in spaces.gymnasium.registry:
            spaces.gymnasium.register(_name, entry_point="seldinger.gym:Env", vector_entry_point="seldinger.gym:VectorEnv",
                                      max_episode_steps=MAX_EPISODE_STEPS, kwargs=ENVIRONMENTS[_name])
