"""Environments by the contract of gymnasium: reset(*, seed, options) -> (observation, info) and step(action) ->
(observation, reward, terminated, truncated, info). They need NumPy alone. Where gymnasium can be imported, Env and
VectorEnv are its subclasses, spaces are its own, and gymnasium.make("seldinger.gym:seldinger/Renal-v1") makes them, too.

    env = sd.gym.make("seldinger/Renal-v1", obs=("tracking2d", "target2d", "image"), image_size=128)
    observation, info = env.reset(seed=7)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

import inspect
from typing import Any, Mapping, Optional

import numpy as np

from .. import _core
from .._core import InputError
from . import spaces
from .batch import KEYS, Batch, checked_seed, one, whole, with_masks

__all__ = ["AUTORESET", "ENVIRONMENTS", "Env", "KEYS", "VectorEnv", "check_env", "make", "make_vec", "spaces"]

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

AUTORESET = ("NEXT_STEP", "SAME_STEP", "DISABLED")

_bases = (spaces.gymnasium.Env if spaces.gymnasium else object,
          spaces.gymnasium.vector.VectorEnv if spaces.gymnasium else object)


def _with_arguments(init: Any) -> Any:
    """Shows Batch's arguments, which a constructor passes on, as its own."""
    own = [p for p in inspect.signature(init).parameters.values() if p.kind is not p.VAR_KEYWORD]
    more = [p for p in inspect.signature(Batch).parameters.values()
            if p.kind is p.KEYWORD_ONLY and p.name not in ("threads", "panel")]
    init.__signature__ = inspect.Signature(own + more)
    return init


class Env(_bases[0]):
    """One environment.

    scenario           as for seldinger.Simulation
    obs                key or keys of the observation, a dict of float32 arrays with finite bounds (values beyond are clipped):
        tracking2d (n_points, 2), target2d (2,)      in pixels of an image of image_size
        tracking3d (n_points, 3), target3d (3,)      mm; points from the tip backward
        inserted_length (n_devices,) mm; rotation (n_devices, 2): sine and cosine of the hub; last_action
        joint_pos (3 n_points,) mm, joint_vel (3 n_points,) mm/s: of the tracked points; force (2,): of tip, largest [N]
        image, guidewire, phantom (image_size, image_size, 1) uint8: an X-ray image, masks of wire and vessels
    image_size         pixels along a side, 32 to 2048
    n_points, resolution_mm   how many points are tracked, and how far apart
    action             'velocity': Box(-1, 1, (n_devices, 2)), times 35 mm/s and 3.14 rad/s; 'physical': mm/s and rad/s.
                       n_devices is 2 where the scenario has a catheter: rows are wire, catheter
    flat_action        (2 n_devices,) instead
    reward             'path_delta': 0.01 a mm nearer along the vessels, 1 at the target, -0.001 a step
                       'distance': -0.001 a mm of straight distance each step, 10 at the target
                       'sparse': 1 at the target; or a callable of the info that returns a finite number
    max_episode_steps  steps to truncation
    frame_skip         frames a step, 1 to 1000000; the scenario's frame_rate_hz is usually 15
    patience           steps in a row without a rest of the wire, or with a motion refused, to truncation
    randomize          drawn at each reset: 'anatomy_seed': (first, end) of the vessels' seeds; 'target': 'branches' (any
                       place in any branch), 'targets' (those named), or a list of branches; 'c_arm_deg': largest turn of
                       the C-arm in either angle; 'scenario': a scenario or a list of them, with as many devices, frames a
                       second and pixels as the one above
    set                values in place of the scenario's, as for Simulation
    cache              as for Simulation
    hashes             whether info has the state's hash
    pool_size          anatomies that are kept in memory
    beam               whether the foot is on the pedal in every frame, and dose is measured; images need no beam
    render_mode        'rgb_array': the image; 'panel': the room's panel around it, with readouts; or None

    terminated: the tip is within the target's radius. truncated: info['truncation'] is 'steps', 'time' (the scenario's
    limit), 'vessel_end' (the tip is past an end of the vessels) or 'not_certified' (see patience), else None.
    info: success, truncation, branch, path_ratio (way left over that at the start), path_to_target_mm, tip_to_target_mm,
    tip_force_N, wall_force_N, push_N, torque_Nmm, certified, time_s, reward (its parts), hash (that of State, its 64 bits as
    a signed int, which arrays of int64, tensors and JSON take: hash % 2**64 == State.hash), dose (a dict of air_kerma_mGy and
    area_product_Gycm2 of the episode, 0 without beam).
    Raises InputError for arguments that are not accepted, and after close().
    """

    metadata = {"render_modes": ["rgb_array", "panel"], "render_fps": 15}

    @_with_arguments
    def __init__(self, scenario: Any = "renal", *, render_mode: Optional[str] = None, **arguments: Any) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode: {render_mode!r} was given; expected 'rgb_array', 'panel' or None")
        self.render_mode = render_mode
        self._batch = Batch(scenario, None, threads=1, panel=render_mode == "panel", **arguments)
        self.action_space = self._batch.action_space
        self.observation_space = self._batch.observation_space
        self._done = True

    @property
    def simulation(self) -> _core.VectorSimulation:
        """The simulation: one of a VectorSimulation of one, for snapshot(0), restore(0, …), score(0), save(0, path)."""
        return self._batch.sim

    def reset(self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None) -> tuple[dict, dict]:
        """Begins an episode and returns (observation, info). All that is drawn, now and in later resets, follows from
        the seed, a whole number of 0 or more: the same seed gives the same states, to the bit, on every machine. Without
        one, drawing goes on."""
        seed = checked_seed(seed)
        self._batch.require_open()
        if spaces.gymnasium:
            super().reset(seed=seed)
        self._batch.reset(np.ones(1, bool), [seed])
        self._done = False
        info = self._batch.judge(np.zeros(1, bool))[3]
        return self._first(self._batch.observe()), one(info, 0)

    def step(self, action: Any) -> tuple[dict, float, bool, bool, dict]:
        """Makes a step and returns (observation, reward, terminated, truncated, info). Actions beyond the space are
        clipped. Raises InputError for another shape, numbers that are not finite, and after the end of an episode."""
        self._batch.require_open()
        if self._done:
            raise InputError("the episode is over, or none was begun; expected reset()")
        active = np.ones(1, bool)
        self._batch.act(self._batch.checked(action, active), active)
        reward, terminated, truncated, info = self._batch.judge(active)
        self._done = bool(terminated[0] or truncated[0])
        return (self._first(self._batch.observe()), float(reward[0]), bool(terminated[0]), bool(truncated[0]),
                one(info, 0))

    def render(self) -> Optional[np.ndarray]:
        """(image_size, image_size, 3) uint8 with render_mode='rgb_array', (1024, 1280, 3) with 'panel', else None."""
        if self.render_mode is None:
            return None
        self._batch.require_open()
        if self.render_mode == "panel":
            return self._batch.sim.panel(0, seed=self._batch.noise[0])
        image = self._batch.sim.images(self._batch.image_size, seeds=self._batch.noise)[0]
        return np.repeat(image[..., None], 3, -1)

    def close(self) -> None:
        """Frees the simulations."""
        self._batch.sim.close()
        self._batch.pool.clear()

    @staticmethod
    def _first(observation: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {key: value[0] for key, value in observation.items()}


class VectorEnv(_bases[1]):
    """n environments that step at once, on `threads` threads (by default one for each core; results do not depend on
    it). Other arguments are those of Env. Observations are dicts of (n, …) arrays; rewards, terminated and truncated are
    arrays of n. info is as gymnasium's: under each key an array of n, under 'reward' and 'dose' a dict of such, and beside
    each key '_key', (n,) bool: whose values these are; others are 0 or None.

    autoreset   'NEXT_STEP': the step after an episode's end begins the next one; its action is not used, its reward 0.
                'SAME_STEP': the step that ends an episode returns the first observation and info of the next, but for
                info['reward'], the parts of this step's; the last observation is in info['final_obs'][i], and the last
                infos, put together as info is, in info['final_info'], for the i in '_final_obs' and '_final_info'.
                'DISABLED': reset(options={'reset_mask': (n,) bool}) begins the next; a step for an environment that has
                ended raises InputError.
    """

    metadata = {"render_modes": [], "autoreset_mode": "NEXT_STEP"}

    @_with_arguments
    def __init__(self, scenario: Any = "renal", n: int = 2, *, threads: Optional[int] = None,
                 autoreset: str = "NEXT_STEP", **arguments: Any) -> None:
        if autoreset not in AUTORESET:
            raise InputError(f"autoreset: {autoreset!r} was given; expected " + ", ".join(AUTORESET))
        if n is None:
            raise InputError("n: None was given; expected a whole number of 1 to 100000")
        self.autoreset = autoreset
        self._batch = Batch(scenario, n, threads=threads, panel=False, **arguments)
        self.num_envs = n
        self.metadata = dict(self.metadata, autoreset_mode=spaces.gymnasium.vector.AutoresetMode[autoreset]
                             if spaces.gymnasium and hasattr(spaces.gymnasium.vector, "AutoresetMode") else autoreset)
        self.single_action_space = self._batch.action_space
        self.single_observation_space = self._batch.observation_space
        self.action_space = spaces.batched(self.single_action_space, n)
        self.observation_space = spaces.batched(self.single_observation_space, n)
        self._done = np.ones(n, bool)
        self._begun = False

    @property
    def simulation(self) -> _core.VectorSimulation:
        """The simulations."""
        return self._batch.sim

    def reset(self, *, seed: Any = None, options: Optional[Mapping[str, Any]] = None) -> tuple[dict, dict]:
        """Begins episodes and returns (observations, infos). seed: a number, of which the i-th environment takes
        seed + i, or a list of n numbers or None. options: {'reset_mask': (n,) bool} for some alone."""
        n = self.num_envs
        if seed is None or whole(seed) is not None:
            first = checked_seed(seed)
            seeds = [None if first is None else first + i for i in range(n)]
        elif isinstance(seed, (list, tuple, np.ndarray)) and np.ndim(seed) == 1:
            seeds = [checked_seed(one) for one in seed]
        else:
            raise InputError(f"seed: {seed!r} was given; expected a whole number or a list of {n} of them")
        if len(seeds) != n:
            raise InputError(f"seed: {len(seeds)} were given; expected a number or {n} of them")
        mask = np.ones(n, bool) if not options or "reset_mask" not in options \
            else np.asarray(options["reset_mask"])
        if mask.shape != (n,) or mask.dtype != bool:
            raise InputError(f"options: reset_mask of {mask.dtype} and shape {mask.shape} was given; expected a mask, an "
                             f"array of {n} truth values")
        self._batch.require_open()
        self._batch.reset(mask, seeds)
        self._done[mask] = False
        self._begun = True
        return self._batch.observe(), with_masks(self._batch.judge(np.zeros(n, bool))[3], mask)

    def step(self, actions: Any) -> tuple[dict, np.ndarray, np.ndarray, np.ndarray, dict]:
        """Makes a step of each and returns (observations, rewards, terminated, truncated, infos)."""
        n, batch = self.num_envs, self._batch
        batch.require_open()
        if not self._begun or (self.autoreset == "DISABLED" and self._done.any()):
            raise InputError("an episode is over, or none was begun; expected reset()")
        again = self._done.copy()
        given = batch.checked(actions, ~again)
        if again.any():
            batch.reset(again, [None] * n)
            self._done[:] = False
        active = ~again
        batch.act(given, active)
        reward, terminated, truncated, info = batch.judge(active)
        self._done = terminated | truncated
        if self.autoreset == "SAME_STEP" and self._done.any():
            ended, last = self._done.copy(), batch.observe()
            finals = np.full(n, None, object)
            for i in np.flatnonzero(ended):
                finals[i] = {key: value[i].copy() for key, value in last.items()}
            batch.reset(ended, [None] * n)
            parts, final = info["reward"], with_masks(info, ended)
            info = dict(batch.judge(np.zeros(n, bool))[3], reward=parts)
            self._done = np.zeros(n, bool)
            return batch.observe(), reward, terminated, truncated, dict(
                with_masks(info, np.ones(n, bool)), final_obs=finals, _final_obs=ended, final_info=final,
                _final_info=ended.copy())
        return batch.observe(), reward, terminated, truncated, with_masks(info, np.ones(n, bool))

    def close(self, **_: Any) -> None:
        """Frees the simulations."""
        self._batch.sim.close()
        self._batch.pool.clear()


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


def make_vec(name: str, n: int, **arguments: Any) -> VectorEnv:
    """n environments of that name at once. Arguments are those of VectorEnv."""
    return VectorEnv(n=n, **_arguments(name, arguments))


def check_env(env: Env, seed: int = 0, steps: int = 10) -> None:
    """Checks the contract: spaces, 5-tuples, dtypes, bounds, and that a seed gives the same episode. Raises
    AssertionError with what is wrong."""
    def follow() -> list[tuple]:
        env.action_space.seed(seed)
        observation, info = env.reset(seed=seed)
        assert isinstance(info, dict), "info is no dict"
        made: list[tuple] = [(observation, info.get("hash"))]
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
            spaces.gymnasium.register(_name, entry_point="seldinger.gym:Env", kwargs=ENVIRONMENTS[_name])
