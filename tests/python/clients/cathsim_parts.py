"""cathsim_parts.py CACHE, run by python3 -m seldinger.compat.cathsim: wrappers, trajectories, metrics and configuration of
CathSim's own sources over the environment of compat.cathsim, its own tests of them, and Stable-Baselines3's check of it."""

import os
import sys
import warnings
from pathlib import Path

warnings.simplefilter("ignore")

import cathsim.gym.envs  # noqa: E402
import cv2  # noqa: E402
import gymnasium as gym  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402
from cathsim.gym.envs import CathSim  # noqa: E402
from cathsim.gym.wrappers import GoalEnvWrapper, MultiInputImageWrapper, SingleDict2Array  # noqa: E402
from cathsim.gym.wrappers import TransformDictObservation  # noqa: E402
from cathsim.rl import Config, evaluation, make_gym_env  # noqa: E402
from cathsim.rl.data import Trajectory  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from stable_baselines3.common.env_checker import check_env as check_of_sb3  # noqa: E402


def main(cache):
    assert CathSim.__module__ == "seldinger.compat.cathsim" and gym.__version__.startswith("0.29")

    def make(**arguments):
        return gym.make("cathsim/CathSim-v0", cache=cache, **arguments)

    for arguments in ({}, dict(use_pixels=True, use_segment=True)):
        check_env(make(**arguments).unwrapped, skip_render_check=True)
        check_of_sb3(make(**arguments))
    env = GoalEnvWrapper(make())
    observation, _ = env.reset(seed=0)
    np.testing.assert_allclose(observation["achieved_goal"], env.unwrapped.head_pos)
    env.set_goal(np.array([0.01, 0.02, 0.1]))
    assert env.reset()[0]["desired_goal"].tolist() == [0.01, 0.02, 0.1]
    for arguments, shape in (({}, (80, 80, 3)), (dict(grayscale=True), (80, 80, 1)),
                             (dict(grayscale=True, keep_dim=False), (80, 80)), (dict(channel_first=True), (3, 80, 80)),
                             (dict(grayscale=True, channel_first=True), (1, 80, 80))):
        env = MultiInputImageWrapper(make(use_pixels=True), **arguments)
        assert env.reset()[0]["pixels"].shape == shape == env.observation_space["pixels"].shape
    grey = TransformDictObservation(make(use_pixels=True), lambda one: cv2.cvtColor(one, cv2.COLOR_RGB2GRAY), "pixels")
    assert grey.reset()[0]["pixels"].shape == (80, 80)
    assert SingleDict2Array(make(use_pixels=True)).reset()[0].shape == (80, 80, 3)

    env, played = make(return_info=True, use_force=True), []
    env.action_space.seed(0)
    for seed in range(2):
        trajectory, done = Trajectory(), False
        observation, _ = env.reset(seed=seed)
        while not done:
            action = env.action_space.sample()
            following, reward, terminated, truncated, info = env.step(action)
            done = terminated or truncated
            trajectory.add_transition(observation=observation, action=action, reward=reward, next_observation=following,
                                      info=info)
            observation = following
        played.append(trajectory.flatten().to_array().data)
    measured = evaluation.analyze_and_aggregate(played)
    assert measured["episode_length"]["mean"] == 300 and measured["force_max"]["mean"] > 0
    print({key: value if isinstance(value, float) else round(float(value["mean"]), 4) for key, value in measured.items()})

    config = Config(config_name="full", task_kwargs=dict(cache=cache))
    env = make_gym_env(config=config, n_envs=1)
    observation, _ = env.reset(seed=0)
    print({key: value.shape for key, value in observation.items()})
    many = make_gym_env(config=config, n_envs=2)  # in processes of their own
    assert many.env_method("print_spaces") == [None, None]
    assert many.reset()["joint_pos"].shape == (2, 168)
    many.close()
    os.environ["XDG_CACHE_HOME"] = cache  # they name none
    tests = Path(cathsim.gym.__file__).parents[3] / "tests"
    assert pytest.main(["-q", "-p", "no:cacheprovider", *(str(tests / f"test_{name}.py") for name in (
        "wrappers", "trajectory"))]) == 0
    print("all ran")


if __name__ == "__main__":
    main(sys.argv[1])
