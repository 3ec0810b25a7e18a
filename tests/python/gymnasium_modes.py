"""An environment under gymnasium.make_vec in all its modes, against our own VectorEnv: gymnasium_modes.py NAME STEPS CACHE.

Run by test_gymnasium.py where gymnasium is found."""

import json
import sys

import gymnasium
import numpy as np

import seldinger as sd
import seldinger.gym  # noqa: F401: registers the environments

MODES = [("sync", {})] + [("async", {"context": context, "shared_memory": shared})
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


def main():
    name, steps, cache = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    ours = sd.gym.make_vec(name, 2, threads=1, cache=cache)
    assert isinstance(ours, gymnasium.vector.VectorEnv)
    rng = np.random.default_rng(3)
    shape = ours.action_space.shape
    actions = rng.uniform(-0.6, 1, (steps, *shape)).astype(np.float32)
    expected = follow(ours, actions)
    ours.close()
    for mode, arguments in MODES:
        envs = gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode, vector_kwargs=arguments, cache=cache)
        assert envs.action_space.shape == shape
        for k, (theirs, mine) in enumerate(zip(follow(envs, actions), expected)):
            assert theirs.keys() == mine.keys(), (mode, arguments, k, theirs.keys() ^ mine.keys())
            for key, value in mine.items():
                assert theirs[key].dtype == value.dtype, (mode, arguments, k, key, theirs[key].dtype, value.dtype)
                np.testing.assert_array_equal(theirs[key], value, err_msg=f"{mode} {arguments} {k} {key}")
        envs.close()
    alone = gymnasium.make(name, cache=cache)
    _, info = alone.reset(seed=0)
    assert type(info["hash"]) is int and np.array(info["hash"]).dtype == np.int64
    assert json.loads(json.dumps(info["hash"])) == info["hash"]
    assert info["hash"] % 2 ** 64 == int(alone.unwrapped.simulation.hashes()[0])
    alone.close()
    try:
        import torch
        assert torch.tensor(info["hash"]).item() == info["hash"]
    except ImportError:
        pass
    print(len(MODES), "modes,", steps, "steps, equal")


if __name__ == "__main__":
    main()
