"""stEVE's names: an Intervention (vessels, fluoroscopy, devices, target in one), Env with observation, reward, terminal and
truncation made of parts with its names.

    intervention = eve.Intervention("renal")
    env = eve.Env(intervention,
                  observation=eve.ObsDict({"tracking": eve.Tracking2D(n_points=3, resolution=2), "target": eve.Target2D()}),
                  reward=eve.Combination([eve.TargetReachedReward(1.0), eve.PathLengthDelta(0.001), eve.Step(-0.005)]),
                  terminal=eve.TargetReached(), truncation=eve.MaxSteps(200))
    observation, info = env.reset(seed=7)
    observation, reward, terminal, truncation, info = env.step(env.action_space.sample())

Actions are Box(-v, v, (n_devices, 2)) in mm/s and rad/s; normalize_action=True makes them Box(-1, 1), and takes effect.
Two-dimensional places are mm in the plane of the detector at the isocentre, x to the right and y up, as stEVE's fluoroscopy
has them.
"""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence

import numpy as np

from .._core import InputError
from ..gym import Env as _Env
from ..gym import spaces
from ..gym.batch import checked_reward, is_number

__all__ = ["Combination", "Env", "Image", "InsertionLengths", "Intervention", "LastAction", "LastRewardCombination",
           "MaxSteps", "ObsDict", "PathLengthDelta", "Rotation", "SimError", "Step", "Target2D", "Target3D",
           "TargetReached", "TargetReachedReward", "TipToTargetDistDelta", "Tracking2D", "Tracking3D", "TruncationCombination",
           "VesselEnd"]


class Intervention:
    """A scenario, as for seldinger.Simulation, its devices' largest speeds [mm/s, rad/s], of all or one row for each, and
    steps a second, 0.001 to 1000, which are rounded to whole frames of the scenario."""

    def __init__(self, scenario: Any = "renal", *, velocity_limit: Sequence[float] = (35.0, 3.14),
                 image_frequency: float = 7.5, normalize_action: bool = False, target_branches: Any = None,
                 target_threshold: Optional[float] = None, image_size: int = 128, set: Optional[Mapping[str, Any]] = None,
                 cache: Any = None) -> None:
        if not is_number(image_frequency) or not 0.001 <= image_frequency <= 1000:
            raise InputError(f"image_frequency: {image_frequency!r} was given; expected a number from 0.001 to 1000")
        if target_threshold is not None and not is_number(target_threshold):
            raise InputError(f"target_threshold: {target_threshold!r} was given; expected a number")
        self.scenario, self.cache, self.image_size = scenario, cache, image_size
        try:
            self.velocity_limit = np.asarray(velocity_limit, float)
        except (TypeError, ValueError):
            self.velocity_limit = np.empty(0)
        if (self.velocity_limit.shape not in ((2,), (1, 2), (2, 2)) or not np.isfinite(self.velocity_limit).all()
                or not (self.velocity_limit > 0).all()):
            raise InputError(f"velocity_limit: {velocity_limit!r} was given; expected two numbers above 0, mm/s and rad/s, "
                             "or a row of them for each device")
        self.image_frequency, self.normalize_action = image_frequency, normalize_action
        self.target_branches = target_branches
        self.set = dict(set or {})
        if target_threshold is not None:
            self.set["target.radius_mm"] = float(target_threshold)


class _Part:
    """A part of an observation: its key in seldinger.gym, its shape and what becomes of its value."""

    key = ""
    bound = 5000.0

    def shape(self, env: "Env") -> tuple:
        return env._base.observation_space[self.key].shape

    def value(self, env: "Env", observation: Mapping[str, np.ndarray]) -> np.ndarray:
        return observation[self.key]

    def space(self, env: "Env") -> spaces.Space:
        return env._base.observation_space[self.key]


class Tracking3D(_Part):
    """(n_points, 3) mm: points on the device from its tip backward, `resolution` mm apart."""

    key = "tracking3d"

    def __init__(self, n_points: int = 3, resolution: float = 2.0) -> None:
        self.n_points, self.resolution = n_points, resolution


class Tracking2D(Tracking3D):
    """(n_points, 2) mm in the plane of the detector at the isocentre."""

    key = "tracking2d"

    def value(self, env: "Env", observation: Mapping[str, np.ndarray]) -> np.ndarray:
        return env._in_plane(observation[self.key])

    def space(self, env: "Env") -> spaces.Space:
        return spaces.Box(-self.bound, self.bound, self.shape(env))


class Target3D(_Part):
    """(3,) mm."""

    key = "target3d"


class Target2D(_Part):
    """(2,) mm in the plane of the detector at the isocentre."""

    key = "target2d"
    value, space = Tracking2D.value, Tracking2D.space


class InsertionLengths(_Part):
    """(n_devices,) mm."""

    key = "inserted_length"


class Rotation(_Part):
    """(n_devices, 2): sine and cosine of the hub's turn."""

    key = "rotation"


class LastAction(_Part):
    """(n_devices, 2), as the action space has it."""

    key = "last_action"

    def value(self, env: "Env", observation: Mapping[str, np.ndarray]) -> np.ndarray:
        return env._last.copy()

    def space(self, env: "Env") -> spaces.Space:
        return env.action_space


class Image(_Part):
    """(image_size, image_size) uint8."""

    key = "image"

    def value(self, env: "Env", observation: Mapping[str, np.ndarray]) -> np.ndarray:
        return observation[self.key][..., 0]

    def space(self, env: "Env") -> spaces.Space:
        size = env.intervention.image_size
        return spaces.Box(0, 255, (size, size), np.uint8)


class ObsDict:
    """Parts under names."""

    def __init__(self, observations: Mapping[str, _Part]) -> None:
        self.observations = dict(observations)


class _Reward:
    def __init__(self, factor: float) -> None:
        self.factor = factor


class TargetReachedReward(_Reward):
    """factor when the target is reached (eve.reward.TargetReached)."""

    def __call__(self, before: Mapping, info: Mapping) -> float:
        return self.factor * info["success"]


class PathLengthDelta(_Reward):
    """factor times each mm nearer along the vessels."""

    def __call__(self, before: Mapping, info: Mapping) -> float:
        return self.factor * (before["path_to_target_mm"] - info["path_to_target_mm"])


class TipToTargetDistDelta(_Reward):
    """factor times each mm nearer in a straight line."""

    def __call__(self, before: Mapping, info: Mapping) -> float:
        return self.factor * (before["tip_to_target_mm"] - info["tip_to_target_mm"])


class Step(_Reward):
    """factor each step."""

    def __call__(self, before: Mapping, info: Mapping) -> float:
        return self.factor


class Combination:
    """The sum of rewards."""

    def __init__(self, rewards: Sequence[Any]) -> None:
        self.rewards = list(rewards)

    def __call__(self, before: Mapping, info: Mapping) -> float:
        return float(sum(reward(before, info) for reward in self.rewards))


LastRewardCombination = Combination


class TargetReached:
    """Terminal: the tip is within the target's radius."""

    def __call__(self, info: Mapping) -> bool:
        return bool(info["success"])


class MaxSteps:
    """Truncation after so many steps."""

    def __init__(self, max_steps: int) -> None:
        self.max_steps = max_steps

    def __call__(self, info: Mapping) -> bool:
        return info["steps"] >= self.max_steps


class VesselEnd:
    """Truncation where the tip is past an end of the vessels."""

    def __call__(self, info: Mapping) -> bool:
        return info["truncation"] == "vessel_end"


class SimError:
    """Truncation where the wire finds no rest: ours never hangs."""

    def __call__(self, info: Mapping) -> bool:
        return info["truncation"] == "not_certified"


class TruncationCombination:
    """Any of several."""

    def __init__(self, truncations: Sequence[Any]) -> None:
        self.truncations = list(truncations)

    def __call__(self, info: Mapping) -> bool:
        return any(truncation(info) for truncation in self.truncations)


class Env:
    """reset(*, seed, options) and step(action) as stEVE's Env, over one simulation."""

    def __init__(self, intervention: Intervention, observation: Any, reward: Any, terminal: Any,
                 truncation: Any = None) -> None:
        self.intervention = intervention
        self.parts = observation.observations if isinstance(observation, ObsDict) else {"": observation}
        self.single = not isinstance(observation, ObsDict)
        self.reward, self.terminal, self.truncation = reward, terminal, truncation
        tracked = [(part.n_points, part.resolution) for part in self.parts.values() if isinstance(part, Tracking3D)]
        if len(set(tracked)) > 1:
            raise InputError("observation: expected Tracking2D and Tracking3D of one n_points and resolution")
        points, resolution = tracked[0] if tracked else (3, 2.0)
        random = {"target": intervention.target_branches} if intervention.target_branches is not None else None
        arguments = dict(obs=sorted({part.key for part in self.parts.values()}), image_size=intervention.image_size,
                         n_points=points, resolution_mm=resolution, action="physical", reward="sparse",
                         max_episode_steps=10 ** 9, randomize=random, set=intervention.set, cache=intervention.cache)
        base = _Env(intervention.scenario, **arguments)
        rows = intervention.velocity_limit.size // 2
        if rows not in (1, base._batch.devices):
            raise InputError(f"velocity_limit: {rows} rows were given; expected 1 or {base._batch.devices}, as "
                             "the scenario has devices")
        rate = base._batch.about["frame_rate_hz"]
        base._batch.frames = max(1, round(rate / intervention.image_frequency))
        base._batch.step_s = base._batch.frames / rate
        self._base = base
        self._limits = np.broadcast_to(intervention.velocity_limit, (base._batch.devices, 2)).astype(np.float32)
        high = np.ones_like(self._limits) if intervention.normalize_action else self._limits
        self.action_space = spaces.Box(-high, high)
        made = {name: part.space(self) for name, part in self.parts.items()}
        self.observation_space = made[""] if self.single else spaces.Dict(made)
        self._last = np.zeros_like(self._limits)
        self._before: dict[str, Any] = {}
        self._steps = 0

    def _in_plane(self, pixels: np.ndarray) -> np.ndarray:
        size = self.intervention.image_size
        width = self._base._batch.about["field_mm"] / size
        return ((np.asarray(pixels, float) - 0.5 * size) * [width, -width]).astype(np.float32)

    def _observed(self, observation: Mapping[str, np.ndarray]) -> Any:
        made = {name: part.value(self, observation) for name, part in self.parts.items()}
        return made[""] if self.single else made

    def reset(self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None) -> tuple[Any, dict]:
        """Begins an episode: (observation, info). The seed has an effect."""
        observation, info = self._base.reset(seed=seed, options=options)
        self._last[:] = 0
        self._steps = 0
        self._before = info
        return self._observed(observation), info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict]:
        """(observation, reward, terminal, truncation, info). Actions beyond the space are clipped."""
        if not self._before:
            raise InputError("no episode was begun; expected reset()")
        self._base._batch.require_open()
        given = self._base._batch.numbers(action)[0]
        self._last = np.clip(given, self.action_space.low, self.action_space.high)
        speed = self._last * (self._limits if self.intervention.normalize_action else 1)
        self._base._batch.done[:] = False  # the ends are those given here
        observation, _, _, _, info = self._base.step(speed)
        self._steps += 1
        info = dict(info, steps=self._steps)
        reward = checked_reward(self.reward(self._before, info))
        self._before = info
        terminal = bool(self.terminal(info)) if self.terminal else False
        truncation = bool(self.truncation(info)) if self.truncation else False
        return self._observed(observation), reward, terminal, truncation, info

    def render(self) -> np.ndarray:
        """(image_size, image_size) uint8."""
        return self._base._batch.sim.images(self.intervention.image_size, seeds=self._base._batch.noise)[0]

    def close(self) -> None:
        """Frees the simulation."""
        self._base.close()
