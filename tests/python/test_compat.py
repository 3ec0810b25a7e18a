import numpy as np
import pytest

import seldinger as sd
from seldinger.compat import cathsim, eve


def test_cathsim_has_its_keys_and_the_seed_an_effect(cache):
    env = cathsim.make("renal", use_pixels=True, use_segment=True, image_size=48, cache=cache,
                       randomize={"target": "branches"}, max_episode_steps=4)
    observation, info = env.reset(seed=1)
    assert list(env.observation_space.spaces) == ["pixels", "guidewire", "phantom", "joint_pos", "joint_vel"]
    assert env.observation_space.contains(observation) and env.action_space.shape == (2,)
    first = info["target_pos"]
    np.testing.assert_array_equal(env.reset(seed=1)[1]["target_pos"], first)
    assert (env.reset(seed=2)[1]["target_pos"] != first).any()
    for k in range(4):
        observation, reward, terminated, truncated, info = env.step([1.0, 0.0])
        away = np.linalg.norm(info["head_pos"] - info["target_pos"])
        assert reward == pytest.approx(-away + 10 * terminated)
    assert truncated and not terminated and info["truncation"] == "steps"
    sd.gym.check_env(env, steps=3)


def test_cathsim_without_dense_reward_counts_steps(cache):
    env = cathsim.make("renal", dense_reward=False, cache=cache)
    env.reset(seed=0)
    assert env.step([0, 0])[1] == -1


def test_eve_has_its_parts(cache):
    intervention = eve.Intervention("renal", normalize_action=True, cache=cache)
    env = eve.Env(intervention,
                  eve.ObsDict({"tracking": eve.Tracking2D(n_points=4, resolution=3), "target": eve.Target2D(),
                               "place": eve.Tracking3D(4, 3), "length": eve.InsertionLengths(), "turn": eve.Rotation(),
                               "last": eve.LastAction()}),
                  eve.Combination([eve.TargetReachedReward(1.0), eve.PathLengthDelta(0.001), eve.Step(-0.005)]),
                  eve.TargetReached(), eve.TruncationCombination([eve.MaxSteps(3), eve.VesselEnd(), eve.SimError()]))
    with pytest.raises(sd.InputError, match="reset"):
        env.step([[0, 0]])
    observation, info = env.reset(seed=4)
    assert env.observation_space.contains(observation)
    way, inserted = info["path_to_target_mm"], observation["length"][0]
    observation, reward, terminal, truncation, info = env.step([[1.0, 0.0]])
    # 7.5 steps a second at 35 mm/s: normalize_action takes effect.
    assert observation["length"][0] - inserted == pytest.approx(35 / 7.5, rel=1e-5)
    assert reward == pytest.approx(0.001 * (way - info["path_to_target_mm"]) - 0.005)
    assert observation["last"].tolist() == [[1.0, 0.0]] and not terminal and not truncation
    # In the plane of the detector, a step along the table's axis is one up the image; the view is from the front.
    isocentre = np.array([0.0, 0.0, -10.0])
    flat, deep = observation["tracking"][0], observation["place"][0] - isocentre
    assert flat == pytest.approx(deep[[0, 2]], rel=0.2)
    assert [env.step([[0.1, 0.0]])[3] for _ in range(2)] == [False, True]
    env.close()


def test_eve_takes_one_part_and_physical_actions(cache):
    env = eve.Env(eve.Intervention("renal_cobra", image_frequency=15, image_size=40, cache=cache), eve.Image(),
                  eve.TipToTargetDistDelta(1.0), eve.TargetReached(), eve.MaxSteps(9))
    observation, _ = env.reset(seed=0)
    assert observation.shape == (40, 40) and env.observation_space.contains(observation)
    assert env.action_space.shape == (2, 2) and env.action_space.high[1].tolist() == pytest.approx([35, 3.14])
    before = env._base.simulation.inserted_mm[0].copy()
    env.step([[15.0, 0.0], [0.0, 0.0]])
    assert env._base.simulation.inserted_mm[0] - before == pytest.approx([1.0, 0.0], abs=1e-6)
    assert env.render().shape == (40, 40)


def simple(cache, scenario="s_bend", reward=eve.Step(-1.0), **arguments):
    return eve.Env(eve.Intervention(scenario, cache=cache, **arguments), eve.LastAction(), reward, eve.TargetReached(),
                   eve.MaxSteps(9))


def test_eve_refuses_actions_before_anything_is_kept(cache):
    env = simple(cache)
    env.reset(seed=0)
    last = env.step([[7.0, 0.5]])[0]
    before = int(env._base.simulation.hashes()[0])
    for action in ([[np.nan, 0]], "x", None, [0, 0, 0], [[1j, 0]]):
        with pytest.raises(sd.InputError, match="action: "):
            env.step(action)
        np.testing.assert_array_equal(env._last, last)
    assert int(env._base.simulation.hashes()[0]) == before and env._steps == 1
    env.close()
    for call in (lambda: env.step([[0, 0]]), lambda: env.reset(seed=0), env.render):
        with pytest.raises(sd.InputError, match="closed"):
            call()


@pytest.mark.parametrize("arguments, says", [
    ({"velocity_limit": (1, 2, 3)}, "velocity_limit"), ({"velocity_limit": (0, 1)}, "velocity_limit"),
    ({"velocity_limit": (np.nan, 1)}, "velocity_limit"), ({"velocity_limit": "fast"}, "velocity_limit"),
    ({"velocity_limit": [(35, 3), (20, 2)]}, "velocity_limit: 2 rows"), ({"image_frequency": 0}, "0.001 to 1000"),
    ({"image_frequency": 1e-9}, "0.001 to 1000"), ({"image_frequency": np.inf}, "0.001 to 1000"),
    ({"image_frequency": "x"}, "0.001 to 1000"), ({"target_threshold": "x"}, "target_threshold"),
    ({"target_threshold": 500}, "radius_mm"), ({"target_branches": ["nowhere"]}, "nowhere"), ({"image_size": 8}, "32 to 2048")])
def test_eve_names_arguments_that_are_not_accepted(cache, arguments, says):
    with pytest.raises(sd.InputError, match=says):
        simple(cache, **arguments)


def test_eve_takes_a_row_of_speeds_for_each_device(cache):
    env = simple(cache, "renal_cobra", velocity_limit=[(35, 3), (20, 2)])
    assert env.action_space.high.tolist() == [[35, 3], [20, 2]]


def test_eve_refuses_rewards_that_are_no_numbers(cache):
    env = simple(cache, reward=lambda before, info: float("nan"))
    env.reset(seed=0)
    with pytest.raises(sd.InputError, match="reward: the callable returned nan"):
        env.step([[0, 0]])


def test_cathsim_says_what_actions_of_two_devices_are(cache):
    env = cathsim.make("renal_cobra", cache=cache)
    assert env.action_space.shape == (4,)
    env.reset(seed=0)
    with pytest.raises(sd.InputError, match=r"shape \(4,\)"):
        env.step([0, 0])
    before = env.simulation.inserted_mm[0].copy()
    env.step([1, 0, -1, 0])
    assert (np.sign(env.simulation.inserted_mm[0] - before) == [1, -1]).all()
