"""An environment under gymnasium.make_vec in all its modes, against our own VectorEnv: gymnasium_modes.py NAME STEPS CACHE.

Run by test_gymnasium.py where gymnasium is found."""

import copy
import json
import pickle
import sys

import gymnasium
import numpy as np
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env

import seldinger as sd
import seldinger.gym  # noqa: F401: registers the environments

MODES = [("vector_entry_point", {}), ("sync", {})] + [("async", {"context": context, "shared_memory": shared})
                          for context in ("fork", "spawn", "forkserver") for shared in (True, False)]


def infos(info):
    """The values of an info by their path, masks among them."""
    for key, value in info.items():
        if isinstance(value, dict):
            for more, inner in infos(value):
                yield f"{key}.{more}", inner
        else:
            yield key, value


def follow(envs, actions):
    """All that an environment says: a list of flat dicts."""
    said = []

    def keep(observation, info, rest=()):
        said.append({**{f"obs.{key}": value.copy() for key, value in observation.items()},
                     **{f"rest.{k}": np.array(value) for k, value in enumerate(rest)},
                     **{f"info.{path}": np.array(value) for path, value in infos(info)}})
    keep(*envs.reset(seed=0))
    for action in actions:
        observation, *rest, info = envs.step(action)
        keep(observation, info, rest)
    return said


def limits(name, cache):
    """The number of steps is that of gymnasium's spec, or that which it was asked for, and no other one."""
    spec = gymnasium.spec(name)
    assert spec.max_episode_steps == sd.gym.MAX_EPISODE_STEPS and spec.vector_entry_point == "seldinger.gym:VectorEnv"
    assert gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(spec.to_json()), cache=cache).spec.id == name
    for asked, expected in ((7, 7), (310, 310), (None, 300), (-1, 320)):
        env = gymnasium.make(name, max_episode_steps=asked, cache=cache, patience=10 ** 6, set={"target.radius_mm": 0.1})
        env.reset(seed=0)
        count, truncated = 0, False
        while not truncated and count < 320:
            _, _, terminated, truncated, info = env.step(np.zeros(env.action_space.shape, np.float32))
            count += 1
        assert count == expected and truncated == (asked != -1) and info["truncation"] is None, (asked, count, info)
    many = gymnasium.make_vec(name, num_envs=3, max_episode_steps=2, autoreset="SAME_STEP", render_mode="rgb_array", cache=cache)
    assert many.spec.id == name and many.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.SAME_STEP
    many.reset(seed=1)
    many.step(many.action_space.sample() * 0)
    assert many.step(many.action_space.sample() * 0)[3].all() and len(many.render()) == 3
    many.close()


def wrapped(name, cache):
    """Wrappers that need a spec, options or copies."""
    env = wrappers.RecordEpisodeStatistics(gymnasium.make(name, cache=cache))
    timed = wrappers.TimeAwareObservation(env, flatten=False)
    observation, _ = timed.reset(seed=4, options={"set": {"seed": 5}})
    assert timed.observation_space.contains(observation) and env.unwrapped.drawn["seed"] == 5
    action = np.full(env.action_space.shape, 0.3, np.float32)
    env.step(action)
    env.action_space.seed(1)
    after = copy.deepcopy(env).step(action)
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        ours = twin.step(action)
        assert ours[1:4] == after[1:4] and ours[4] == after[4], (ours, after)
        np.testing.assert_equal(ours[0], after[0])
        assert twin.action_space.sample().tolist() == copy.deepcopy(env).action_space.sample().tolist()
        assert twin.spec.id == name and isinstance(twin.unwrapped, gymnasium.Env)


def main():
    name, steps, cache = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    ours = sd.gym.make_vec(name, 2, threads=1, cache=cache, max_episode_steps=2 * steps // 3)
    assert isinstance(ours, gymnasium.vector.VectorEnv)
    rng = np.random.default_rng(3)
    shape = ours.action_space.shape
    actions = rng.uniform(-0.6, 1, (steps, *shape)).astype(np.float32)
    expected = follow(ours, actions)
    ours.close()
    for mode, arguments in MODES:
        envs = gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode, vector_kwargs=arguments, cache=cache,
                                  max_episode_steps=2 * steps // 3)
        assert envs.action_space.shape == shape
        for k, (theirs, mine) in enumerate(zip(follow(envs, actions), expected)):
            assert theirs.keys() == mine.keys(), (mode, arguments, k, theirs.keys() ^ mine.keys())
            for key, value in mine.items():
                assert theirs[key].dtype == value.dtype, (mode, arguments, k, key, theirs[key].dtype, value.dtype)
                if key.endswith("info.truncation") and mode != "vector_entry_point":
                    value = np.where(value == "steps", None, value)  # TimeLimit ends it, and says nothing
                np.testing.assert_array_equal(theirs[key], value, err_msg=f"{mode} {arguments} {k} {key}")
        envs.close()
    alone = gymnasium.make(name, cache=cache, render_mode="rgb_array", image_size=48)
    check_env(alone.unwrapped)
    if name == "seldinger/Renal-v1":
        limits(name, cache)
    wrapped(name, cache)
    _, info = alone.reset(seed=0)
    assert type(info["hash"]) is int and np.array(info["hash"]).dtype == np.int64
    assert json.loads(json.dumps(info)) == info
    alone.close()
    try:
        import torch
        assert torch.tensor(info["hash"]).item() == info["hash"]
    except ImportError:
        pass
    print(len(MODES), "modes,", steps, "steps, equal")


if __name__ == "__main__":
    main()
