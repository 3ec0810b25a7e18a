"""What Gymnasium and Stable-Baselines3 ask of environments and make of what they say, recorded from themselves:
record_contracts.py gymnasium|stable_baselines3 CACHE prints it as JSON.

    PYTHONPATH=build/python:GYMNASIUM python3 tests/python/record_contracts.py gymnasium CACHE > tests/python/contracts/gymnasium.json

test_contracts.py holds the module against the recordings, and these against what is installed."""

import inspect
import json
import sys

import numpy as np

import seldinger as sd

NAME = "seldinger/DualDevice-v1"
ARGUMENTS = {"max_episode_steps": 2, "obs": ["tracking2d", "target2d", "rotation", "image"], "image_size": 32}
# Infos of two environments, as gymnasium puts them together.
INFOS = [({"a": 1.5}, {"a": 2.5}), ({"a": 1}, {"a": -2 ** 63}), ({"a": True}, {"a": False}), ({"a": "x"}, {"a": None}),
         ({"a": None}, {"a": None}), ({"a": {"b": 1.0}}, {"a": {"b": 2.0, "c": "y"}}), ({"a": 1}, {}), ({}, {"b": {"c": 1}}),
         ({"a": [1.0, 2.0]}, {"a": [3.0, 4.0]})]


def described(value):
    """Types, shapes and dtypes of what may be nested."""
    if isinstance(value, dict):
        return {key: described(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [described(inner) for inner in value]
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}"
    return type(value).__name__


def as_json(value):
    """With arrays as dtype and list."""
    if isinstance(value, dict):
        return {key: as_json(inner) for key, inner in value.items()}
    return [str(value.dtype), value.tolist()] if isinstance(value, np.ndarray) else value


def space(of):
    return {key: [list(one.shape), str(one.dtype), float(one.low.min()), float(one.high.max())]
            for key, one in (of.spaces if hasattr(of, "spaces") else {"": of}).items()}


def spaces_of(envs):
    return {name: space(getattr(envs, name)) for name in ("action_space", "observation_space", "single_action_space",
                                                           "single_observation_space") if hasattr(envs, name)}


def parameters(function):
    return [name for name in inspect.signature(function).parameters if name != "self"]


def steps(envs, shape):
    """What reset and three steps of two environments return; the second ends the episodes."""
    made = envs.reset(seed=5) if "seed" in inspect.signature(envs.reset).parameters else envs.reset()
    said = [described(made)]
    for _ in range(3):
        said.append(described(envs.step(np.zeros(shape, np.float32))))
    return said


def gymnasium(cache):
    import gymnasium

    given = {}

    def keep(**arguments):
        given.update(arguments)
        return sd.gym.make("seldinger/Renal-v1", cache=cache) if "num_envs" not in arguments else \
            sd.gym.make_vec("seldinger/Renal-v1", arguments["num_envs"], cache=cache)
    gymnasium.register("seldinger/Probe-v1", entry_point=keep, vector_entry_point=keep, max_episode_steps=300, kwargs={"own": 1})
    made = {"register": parameters(gymnasium.register)}
    for key, call in (("make", lambda: gymnasium.make("seldinger/Probe-v1", max_episode_steps=7, more=2)),
                      ("make_vec", lambda: gymnasium.make_vec("seldinger/Probe-v1", num_envs=2, more=2, render_mode="rgb_array"))):
        given.clear()
        call().close()
        made[key] = dict(given)
    made["autoreset"] = [mode.name for mode in gymnasium.vector.AutoresetMode]
    made["vector_env"] = {name: parameters(getattr(gymnasium.vector.VectorEnv, name)) for name in ("reset", "step", "close")}
    adder = gymnasium.vector.VectorEnv()
    adder.num_envs = 2
    made["added"] = []
    for infos in INFOS:
        together = {}
        for i, info in enumerate(infos):
            together = adder._add_info(together, info, i)
        made["added"].append(as_json(together))
    for mode in ("NEXT_STEP", "SAME_STEP"):
        envs = gymnasium.vector.SyncVectorEnv([lambda: sd.gym.make(NAME, cache=cache, **ARGUMENTS)] * 2,
                                              autoreset_mode=gymnasium.vector.AutoresetMode[mode])
        made[mode] = steps(envs, envs.action_space.shape)
        made["spaces"] = spaces_of(envs)
        envs.close()
    return made


def stable_baselines3(cache):
    from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

    made = {"methods": {name: parameters(method) for name, method in inspect.getmembers(VecEnv, inspect.isfunction)
                        if not name.startswith("_") and (method.__name__ in VecEnv.__abstractmethods__ or name in
                                                         ("step", "seed", "set_options", "get_images"))}}
    envs = DummyVecEnv([lambda: sd.gym.make(NAME, cache=cache, **ARGUMENTS)] * 2)
    envs.seed(5)
    made["attributes"] = ["_options", "_seeds", "action_space", "metadata", "num_envs", "observation_space", "render_mode",
                          "reset_infos"]
    assert set(made["attributes"]) <= set(envs.__dict__)
    made["steps"] = steps(envs, (2, *envs.action_space.shape))
    made["spaces"], made["reset_infos"] = spaces_of(envs), described(envs.reset_infos)
    envs.close()
    return made


def text(recorded):
    return "{\n" + ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in recorded.items()) + "\n}"


if __name__ == "__main__":
    print(text({"gymnasium": gymnasium, "stable_baselines3": stable_baselines3}[sys.argv[1]](sys.argv[2])))
