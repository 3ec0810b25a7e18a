"""CathSim's names: make(...) gives an environment with its observations ('pixels', 'guidewire', 'phantom', 'joint_pos',
'joint_vel'), actions (Box(-1, 1, (2,)): feed and turn of the wire; in a scenario with a catheter (4,), its feed and turn after them)
and reward (minus the distance in m, 10 at the target).

Two things differ on purpose: a seed has an effect, and the end of the steps is `truncated`, not `terminated`.
"""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence

import numpy as np

from ..gym import Env
from ..gym.spaces import Dict

__all__ = ["CathSim", "make"]

_NAMES = {"pixels": "image", "guidewire": "guidewire", "phantom": "phantom", "joint_pos": "joint_pos",
          "joint_vel": "joint_vel"}


class CathSim(Env):
    """Env with CathSim's keys. use_pixels, use_segment (masks): what besides joint_pos and joint_vel is observed.

    phantom    a scenario as for seldinger.Simulation; target: a name or a branch's, by default the scenario's
    dense_reward   minus the straight distance in m each step, else -1; 10 at the target
    """

    def __init__(self, phantom: Any = "renal", *, use_pixels: bool = False, use_segment: bool = False,
                 image_size: int = 80, dense_reward: bool = True, n_points: int = 20, target: Optional[str] = None,
                 max_episode_steps: int = 300, **arguments: Any) -> None:
        obs = ["joint_pos", "joint_vel"] + ["image"] * use_pixels + ["guidewire", "phantom"] * use_segment
        reward = "distance" if dense_reward else lambda info: 10.0 if info["success"] else -1.0
        if target is not None:
            arguments["set"] = dict(arguments.get("set") or {}, **{"target.name": target})
        super().__init__(phantom, obs=obs, image_size=image_size, reward=reward, flat_action=True, n_points=n_points,
                         max_episode_steps=max_episode_steps, **arguments)
        self._ours = {theirs: ours for theirs, ours in _NAMES.items() if ours in obs}
        self.observation_space = Dict({theirs: self._batch.observation_space[ours]
                                       for theirs, ours in self._ours.items()})

    def _renamed(self, observation: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {theirs: observation[ours] for theirs, ours in self._ours.items()}

    def reset(self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None) -> tuple[dict, dict]:
        """As Env.reset; info has 'head_pos' and 'target_pos' [m]."""
        observation, info = super().reset(seed=seed, options=options)
        return self._renamed(observation), self._places(info)

    def step(self, action: Sequence[float]) -> tuple[dict, float, bool, bool, dict]:
        """As Env.step; info has 'head_pos' and 'target_pos' [m]."""
        observation, reward, terminated, truncated, info = super().step(action)
        return self._renamed(observation), reward, terminated, truncated, self._places(info)

    def _places(self, info: dict[str, Any]) -> dict[str, Any]:
        return dict(info, head_pos=1e-3 * self.simulation.tip_mm[0], target_pos=1e-3 * self.simulation.target_mm[0])


def make(phantom: Any = "renal", **arguments: Any) -> CathSim:
    """The environment; arguments are those of CathSim."""
    return CathSim(phantom, **arguments)
