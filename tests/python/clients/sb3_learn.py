"""sb3_learn.py CACHE: Stable-Baselines3's check of two environments, and PPO for 256 steps on a vector of four."""

import sys
import warnings

warnings.simplefilter("ignore")

import gymnasium  # noqa: E402
import seldinger.gym  # noqa: E402,F401
from stable_baselines3 import PPO  # noqa: E402
from stable_baselines3.common.env_checker import check_env  # noqa: E402
from stable_baselines3.common.env_util import make_vec_env  # noqa: E402


def main(cache):
    for name, arguments in (("Renal", {}), ("DualDevice", {"obs": ("tracking3d", "target3d", "force"), "flat_action": True})):
        check_env(gymnasium.make(f"seldinger/{name}-v1", cache=cache, **arguments))
    envs = make_vec_env("seldinger/Renal-v1", n_envs=4, env_kwargs={"cache": cache, "frame_skip": 2, "max_episode_steps": 20})
    model = PPO("MultiInputPolicy", envs, n_steps=32, batch_size=32, n_epochs=2, seed=0, device="cpu").learn(256)
    assert model.num_timesteps == 256 and len(model.ep_info_buffer) >= 8
    returns = [one["r"] for one in model.ep_info_buffer]
    print("learnt for 256 steps; mean return", round(sum(returns) / len(returns), 3))


if __name__ == "__main__":
    main(sys.argv[1])
