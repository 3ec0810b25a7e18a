"""Environments for Stable-Baselines3: a VecEnv on our pool of threads.

    from seldinger.gym.sb3 import make_vec_env
    model = PPO("MultiInputPolicy", make_vec_env("seldinger/Renal-v1", 16, seed=0))

Observations are dicts, for "MultiInputPolicy". Without Stable-Baselines3 the class is there, and derived from nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .._arrays import NDArray
from .._core import InputError
from . import Observation, _arguments, _OfSeveral
from .batch import Batch, checked_seed, one
from .draws import whole

__all__ = ["FromTheTip", "SeldingerVecEnv", "make_vec_env"]

if TYPE_CHECKING:
    _Base = object
    _Wrapper = object
else:
    try:
        _Base = importlib.import_module("stable_baselines3.common.vec_env").VecEnv
        _Wrapper = importlib.import_module("stable_baselines3.common.vec_env").VecEnvWrapper
    except ImportError:
        _Base = _Wrapper = object

_SHARED = ("action_space", "metadata", "observation_space", "randomize", "render_mode", "spec")


class SeldingerVecEnv(_OfSeveral, _Base):
    """num_envs environments as Stable-Baselines3 has them: the step that ends an episode returns the first observation of the
    next; the last one is in info['terminal_observation'], and info['TimeLimit.truncated'] says whether it was cut off.
    threads, as VectorEnv; other arguments are those of Env.

    get_attr('drawn') says what each has drawn, set_attr('randomize', …) changes what resets draw, of all; env_method knows
    snapshot() and restore(snapshot)."""

    def __init__(self, scenario: Any = "renal", num_envs: int = 1, *, threads: Optional[int] = None, **arguments: Any) -> None:
        if whole(num_envs) is None:
            raise InputError(f"num_envs: {num_envs!r} was given; expected a whole number of 1 to 100000")
        self._batch = Batch(scenario, num_envs, threads=threads, **arguments)
        self.num_envs = num_envs
        self.observation_space = self._batch.observation_space
        self.action_space = self._batch.action_space
        self.render_mode = self._batch.render_mode
        self.reset_infos: List[Dict[str, Any]] = [{} for _ in range(num_envs)]
        self._seeds: List[Optional[int]] = [None] * num_envs
        self._options: List[Dict[str, Any]] = [{} for _ in range(num_envs)]
        if _Base is not object:
            super().__init__(num_envs, self.observation_space, self.action_space)  # type: ignore[call-arg]
        self.metadata = {"render_modes": ["rgb_array", "panel"], "render_fps": 1 / self._batch.step_s}

    def seed(self, seed: Optional[int] = None) -> Sequence[Optional[int]]:
        """Seeds of the next reset: the i-th environment takes seed + i."""
        first = checked_seed(seed)
        if first is None:
            first = int(np.random.randint(0, 2 ** 31))
        self._seeds = [first + i for i in range(self.num_envs)]
        return self._seeds

    def set_options(self, options: Any = None) -> None:
        """Options of the next reset, as Env.reset's: a dict for all, or a list of them."""
        each = options if isinstance(options, list) else [options] * self.num_envs
        if len(each) != self.num_envs:
            raise InputError(f"options: {len(each)} were given; expected a dict or {self.num_envs} of them")
        self._options = [self._batch.options(one) for one in each]

    def reset(self) -> Observation:
        """Begins an episode of each and returns the observations."""
        batch = self._batch
        batch.require_open()
        for i in range(self.num_envs):
            seed, options = self._seeds[i], self._options[i]
            batch.reset(np.arange(self.num_envs) == i, [options.get("seed") if seed is None else seed] * self.num_envs, options)
        self._seeds, self._options = [None] * self.num_envs, [{} for _ in range(self.num_envs)]
        info = batch.judge(np.zeros(self.num_envs, bool))[3]
        self.reset_infos = [one(info, i) for i in range(self.num_envs)]
        return batch.observe()

    def step(self, actions: Any) -> Tuple[Observation, NDArray[np.float32], NDArray[np.bool_], List[Dict[str, Any]]]:
        """Makes a step of each and returns (observations, rewards, dones, infos)."""
        self.step_async(actions)
        return self.step_wait()

    def step_async(self, actions: Any) -> None:
        self._batch.require_open()
        if self._batch.done.any():
            raise InputError("no episode was begun; expected reset()")
        self._waiting = self._batch.checked(actions, np.ones(self.num_envs, bool))

    def step_wait(self) -> Tuple[Observation, NDArray[np.float32], NDArray[np.bool_], List[Dict[str, Any]]]:
        batch, everyone = self._batch, np.ones(self.num_envs, bool)
        batch.act(self._waiting, everyone)
        rewards, terminated, truncated, info = batch.judge(everyone)
        infos, done = [one(info, i) for i in range(self.num_envs)], terminated | truncated
        for i, said in enumerate(infos):
            said["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        if done.any():
            _, finals, first = batch.begin_next()
            for i in np.flatnonzero(done):
                infos[i]["terminal_observation"], self.reset_infos[i] = finals[i], one(first, i)
        return batch.observe(), rewards.astype(np.float32), done, infos

    def _each(self, indices: Any) -> List[int]:
        return list(range(self.num_envs)) if indices is None else [indices] if isinstance(indices, int) else list(indices)

    def get_attr(self, attr_name: str, indices: Any = None) -> List[Any]:
        if attr_name == "drawn":
            return [dict(self._batch.drawn[i]) for i in self._each(indices)]
        if attr_name not in _SHARED:
            raise AttributeError(f"'{attr_name}' was asked for; expected drawn, " + ", ".join(_SHARED))
        return [getattr(self, attr_name)] * len(self._each(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        if attr_name != "randomize" or len(self._each(indices)) < self.num_envs:
            raise AttributeError(f"'{attr_name}' of {indices} was to be set; expected randomize, of all")
        self.randomize = value

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> List[Any]:
        if method_name not in ("snapshot", "restore"):
            raise AttributeError(f"'{method_name}' was called; expected snapshot or restore")
        return [getattr(self, method_name)(i, *method_args, **method_kwargs) for i in self._each(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> List[bool]:
        return [False] * len(self._each(indices))

    def get_images(self) -> Sequence[Optional[NDArray[np.uint8]]]:
        frames = self._batch.render()
        return [None] * self.num_envs if frames is None else list(frames)


def make_vec_env(name: str, n_envs: int = 1, *, seed: Optional[int] = None, **arguments: Any) -> SeldingerVecEnv:
    """So many environments of that name. Arguments are those of SeldingerVecEnv."""
    made = SeldingerVecEnv(num_envs=n_envs, **_arguments(name, arguments))
    made.seed(seed)
    return made


class FromTheTip(_Wrapper):
    """A VecEnvWrapper: places in 3D are seen from the tip, so that what is learned in one patient holds in another. Needs the
    observation "tracking3d"."""

    venv: SeldingerVecEnv

    @staticmethod
    def _seen(observation: Observation) -> Observation:
        tip = observation["tracking3d"][..., 0, :]
        places = ("tracking3d", "route3d", "tip3d", "target3d")
        return {key: value - (tip if value.ndim == tip.ndim else tip[..., None, :]) if key.endswith(places) else value
                for key, value in observation.items()}

    def reset(self) -> Observation:
        return self._seen(self.venv.reset())

    def step_wait(self) -> Tuple[Observation, NDArray[np.float32], NDArray[np.bool_], List[Dict[str, Any]]]:
        observation, rewards, done, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self._seen(info["terminal_observation"])
        return self._seen(observation), rewards, done, infos
