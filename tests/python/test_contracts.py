"""The module against what Gymnasium and Stable-Baselines3 were recorded to ask for and to do (contracts/), and these recordings
against what is installed: SELDINGER_GYMNASIUM and SELDINGER_SB3 name folders of sources, else they are imported."""

import copy
import importlib.util
import inspect
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import record_contracts as record
import seldinger as sd
from seldinger.gym.sb3 import SeldingerVecEnv, make_vec_env
from test_gym import together

HERE = Path(__file__).resolve().parent
FOLDERS = {"gymnasium": ("SELDINGER_GYMNASIUM",), "stable_baselines3": ("SELDINGER_GYMNASIUM", "SELDINGER_SB3")}
GYMNASIUM, SB3 = (json.loads((HERE / "contracts" / f"{name}.json").read_text()) for name in FOLDERS)


def found(name):
    """The path on which it is, or nothing where it is nowhere."""
    folders = [os.environ[variable] for variable in FOLDERS[name] if variable in os.environ]
    path = os.pathsep.join([*folders, os.environ.get("PYTHONPATH", "")])
    there = subprocess.run([sys.executable, "-c", f"import {name}"], env=dict(os.environ, PYTHONPATH=path), capture_output=True)
    return path if there.returncode == 0 else None


@pytest.mark.parametrize("name", FOLDERS)
def test_recordings_are_what_the_real_one_does(cache, name):
    path = found(name)
    if not path:
        pytest.skip(f"{name} is not installed, and {' and '.join(FOLDERS[name])} name no folders of its sources")
    made = subprocess.run([sys.executable, HERE / "record_contracts.py", name, cache], capture_output=True, text=True,
                          env=dict(os.environ, PYTHONPATH=path))
    assert made.returncode == 0, made.stderr[-3000:]
    assert json.loads(made.stdout) == (GYMNASIUM if name == "gymnasium" else SB3), "record it anew"


def test_infos_are_put_together_in_tests_as_gymnasium_does():
    for infos, expected in zip(record.INFOS, GYMNASIUM["added"]):
        assert json.loads(json.dumps(record.as_json(together(dict(enumerate(infos)), 2)))) == expected, infos


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP"])
def test_observations_infos_and_spaces_of_many_are_of_the_types_of_gymnasiums(cache, mode):
    many = sd.gym.make_vec(record.NAME, 2, threads=1, autoreset=mode, cache=cache, **record.ARGUMENTS)
    assert json.loads(json.dumps(record.steps(many, many.action_space.shape))) == GYMNASIUM[mode]
    assert json.loads(json.dumps(record.spaces_of(many))) == GYMNASIUM["spaces"]
    for name, expected in GYMNASIUM["vector_env"].items():
        assert len(record.parameters(getattr(many, name))) == len(expected), name


def test_arguments_that_gymnasium_gives_are_taken(cache):
    made = {key: value for key, value in GYMNASIUM["make_vec"].items() if key not in ("own", "more")}
    assert set(made) == {"num_envs", "max_episode_steps", "render_mode"}
    many = sd.gym.VectorEnv("s_bend", cache=cache, **made)
    assert many.num_envs == made["num_envs"] and many.render_mode == made["render_mode"]
    assert set(GYMNASIUM["make"]) == {"own", "more"}  # no steps: TimeLimit counts them
    assert list(sd.gym.AUTORESET) == GYMNASIUM["autoreset"]


def test_where_gymnasium_is_there_it_is_told_of_all_environments_in_its_words(cache, tmp_path):
    """A module with the parameters that gymnasium was recorded to have, whose spaces are ours."""
    names = [name for name in GYMNASIUM["register"] if name != "id"]
    (tmp_path / "gymnasium.py").write_text(f"""
import enum, types, numpy
source = open({str(sd.gym.spaces.__file__)!r}).read().replace('import_module("gymnasium")', 'import_module("nothing")')
spaces = types.ModuleType("spaces")
spaces.__package__ = "seldinger.gym"
exec(source, spaces.__dict__)
registry = {{}}
class Env:
    spec = None
    def reset(self, *, seed=None, options=None): self.told = seed
def register(id, {", ".join(name + "=None" for name in names)}):
    registry[id] = (entry_point, vector_entry_point, max_episode_steps, kwargs)
vector = types.SimpleNamespace(VectorEnv=type("VectorEnv", (), {{}}), AutoresetMode=enum.Enum("AutoresetMode", {GYMNASIUM["autoreset"]}))
""")
    check = """
import importlib, sys, gymnasium, numpy as np, seldinger as sd, seldinger.gym
assert set(gymnasium.registry) == set(sd.gym.ENVIRONMENTS)
for name, (entry, vector, steps, kwargs) in gymnasium.registry.items():
    module, cls = entry.split(":")
    env = getattr(importlib.import_module(module), cls)(**kwargs, cache=sys.argv[1])
    assert isinstance(env, gymnasium.Env) and steps == 300 and vector == "seldinger.gym:VectorEnv"
    assert isinstance(env.action_space, gymnasium.spaces.Box) and isinstance(env.observation_space, gymnasium.spaces.Dict)
env = sd.gym.make("seldinger/Renal-v1", cache=sys.argv[1], max_episode_steps=2)
sd.gym.check_env(env, steps=2)
env.reset(seed=3)
assert env.told == 3 and [env.step([[0, 0]])[3] for _ in range(2)] == [False, True]
env.spec = "one"  # made by gymnasium, whose TimeLimit ends episodes
env.reset()
assert not any(env.step([[0, 0]])[3] for _ in range(4))
many = sd.gym.make_vec("seldinger/Renal-v1", 2, cache=sys.argv[1])
assert isinstance(many, gymnasium.vector.VectorEnv)
assert many.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
"""
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    ended = subprocess.run([sys.executable, "-c", check, str(cache)], env=dict(os.environ, PYTHONPATH=path), capture_output=True,
                           text=True)
    assert ended.returncode == 0, ended.stderr


def vec_env(cache, **arguments):
    return make_vec_env(record.NAME, 2, seed=5, threads=1, cache=cache, **{**record.ARGUMENTS, **arguments})


def test_the_vec_env_has_the_methods_attributes_and_types_of_stable_baselines3(cache):
    envs = vec_env(cache)
    for name, expected in SB3["methods"].items():
        assert record.parameters(getattr(SeldingerVecEnv, name)) == expected, name
    assert set(SB3["attributes"]) <= set(envs.__dict__)
    envs.seed(5)
    assert json.loads(json.dumps(record.steps(envs, (2, *envs.action_space.shape)))) == SB3["steps"]
    assert json.loads(json.dumps(record.spaces_of(envs))) == SB3["spaces"]
    assert record.described(envs.reset_infos) == SB3["reset_infos"]
    assert any("terminal_observation" in info for info in SB3["steps"][2][3])


def test_the_vec_env_steps_as_environments_alone(cache):
    arguments = dict(randomize={"target": "branches"}, max_episode_steps=3, obs=("tracking2d", "target2d"))
    envs = vec_env(cache, **arguments)
    alone = [sd.gym.make(record.NAME, cache=cache, **{**record.ARGUMENTS, **arguments}) for _ in range(2)]
    first = envs.reset()
    expected = [env.reset(seed=5 + i) for i, env in enumerate(alone)]
    rng = np.random.default_rng(1)
    for k in range(8):
        if k == 4:
            envs = [copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))][k % 2]
        for i, (observation, info) in enumerate(expected):
            assert envs.reset_infos[i] == info or not envs._batch.steps[i] == 0
            for key, value in observation.items():
                np.testing.assert_array_equal(first[key][i], value)
        actions = rng.uniform(-1, 1, (2, *envs.action_space.shape))
        first, rewards, dones, infos = envs.step(actions)
        expected = []
        for i, env in enumerate(alone):
            observation, reward, terminated, truncated, info = env.step(actions[i])
            assert rewards[i] == np.float32(reward) and dones[i] == (terminated or truncated)
            assert infos[i]["TimeLimit.truncated"] == (truncated and not terminated)
            assert {key: infos[i][key] for key in info} == info
            if dones[i]:
                for key, value in observation.items():
                    np.testing.assert_array_equal(infos[i]["terminal_observation"][key], value)
                observation, info = env.reset()
                assert envs.reset_infos[i] == info
            expected.append((observation, info))


def test_the_vec_env_takes_seeds_options_ranges_and_snapshots(cache):
    envs = vec_env(cache, obs="target2d")
    with pytest.raises(sd.InputError, match="reset"):
        envs.step(np.zeros((2, 2, 2)))
    envs.set_options([{"target": "RRA"}, {"set": {"seed": 4}}])
    envs.reset()
    assert envs.get_attr("drawn", 1)[0]["seed"] == 4
    targets = envs._batch.sim.target_mm
    assert 5 < np.linalg.norm(targets[0] - targets[1]) < 20  # the scenario has a place of its own in that artery
    with pytest.raises(sd.InputError, match="'goal' was found"):
        envs.set_options({"goal": 1})
    with pytest.raises(sd.InputError, match="3 were given"):
        envs.set_options([{}] * 3)
    kept = envs.env_method("snapshot", indices=0)
    action = np.full((2, 2, 2), 0.5)
    after = envs.step(action)[3][0]["hash"]
    envs.env_method("restore", kept[0], indices=[1])
    assert envs.step(action)[3][1]["hash"] == after
    envs.set_attr("randomize", {"seed": 9})
    envs.reset()
    assert [one["seed"] for one in envs.get_attr("drawn")] == [9, 9] and envs.env_is_wrapped(object) == [False, False]
    for call in (lambda: envs.get_attr("wheels"), lambda: envs.set_attr("drawn", 1), lambda: envs.env_method("close"),
                 lambda: envs.set_attr("randomize", {}, 0)):
        with pytest.raises(AttributeError, match="expected"):
            call()
    assert envs.get_images() == [None, None] and len(envs.seed()) == 2
    assert vec_env(cache, render_mode="rgb_array").get_images()[1].shape == (32, 32, 3)
    envs.close()
    with pytest.raises(sd.InputError, match="closed"):
        envs.reset()
    with pytest.raises(sd.InputError, match="num_envs"):
        SeldingerVecEnv(num_envs="2", cache=cache)


def test_a_policy_of_stable_baselines3_learns_on_the_vec_env(cache):
    """PPO comes nearer to the renal artery."""
    path = found("stable_baselines3")
    if not path:
        pytest.skip("stable_baselines3 is not installed, and SELDINGER_SB3 names no folder of its sources")
    text = """
import sys, numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize
from seldinger.gym.sb3 import make_vec_env
inner = make_vec_env("seldinger/Renal-v1", 16, seed=0, cache=sys.argv[1], frame_skip=2, max_episode_steps=60)
assert isinstance(inner, VecEnv)
model = PPO("MultiInputPolicy", VecNormalize(VecMonitor(inner)), n_steps=64, batch_size=256, ent_coef=0.003, seed=0, device="cpu")
returns = []
def keep(one, _):
    returns.append(np.mean([episode["r"] for episode in one["self"].ep_info_buffer] or [0]))
    return True
model.learn(12288, callback=keep)
print(np.mean(returns[70:140]), returns[-1])
assert returns[-1] > np.mean(returns[70:140]) + 0.15
"""
    ended = subprocess.run([sys.executable, "-c", text, cache], env=dict(os.environ, PYTHONPATH=path), capture_output=True, text=True)
    print(ended.stdout)
    assert ended.returncode == 0, ended.stderr[-3000:] + ended.stdout
