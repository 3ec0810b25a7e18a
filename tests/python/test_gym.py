import inspect
import re

import numpy as np
import pytest

import seldinger as sd

ALL = sd.gym.KEYS


def begun(env, seed=0):
    env.reset(seed=seed)
    return env


def run(env, seed, steps=15):
    observation, info = env.reset(seed=seed)
    rng = np.random.default_rng(1)
    hashes = [info["hash"]]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(
            rng.uniform(-1, 1, env.action_space.shape).astype(np.float32))
        hashes.append(info["hash"])
        if terminated or truncated:
            break
    return hashes


@pytest.mark.parametrize("name", ["seldinger/Renal-v1", "seldinger/DualDevice-v1"])
def test_environments_keep_the_contract(cache, name):
    env = sd.gym.make(name, obs=ALL, image_size=48, cache=cache)
    sd.gym.check_env(env, steps=6)
    env.close()


@pytest.mark.parametrize("name", list(sd.gym.ENVIRONMENTS))
def test_every_environment_that_is_listed_keeps_the_contract_for_many_seeds(cache, name):
    env = sd.gym.make(name, obs=[key for key in ALL if key not in ("image", "guidewire", "phantom")], cache=cache)
    for seed in range(8):
        sd.gym.check_env(env, seed=seed, steps=3)
    env.close()


def test_arches_of_all_three_types_are_drawn(cache):
    env = sd.gym.make("seldinger/ArchVariety-v1", cache=cache)
    drawn = set()
    for seed in range(100):
        env.reset(seed=seed)
        drawn.add(env.drawn["scenario"])
    assert drawn == {"carotid_vertebral", "arch_2", "arch_3"}
    env.close()


@pytest.mark.parametrize("other, says", [
    ("renal_cobra", "devices; 'renal_cobra' has 2, 'renal' has 1"),
    (["renal", "renal_right", "renal_cobra"], "'renal_cobra' has 2"),
    ({"frame_rate_hz": 30}, "frames a second; the dict has 30"),
    ({"c_arm": {"pixels": 256}}, "pixels of the C-arm; the dict has 256"),
])
def test_scenarios_that_take_turns_are_of_one_kind(cache, other, says):
    if isinstance(other, dict):
        first = {"title": "A tube", "tube": {"path": [{"run_mm": 150}], "radius_mm": 3.0},
                 "entry": {"end": "start", "inserted_mm": 60}, "target": {"centre_mm": [100, 0, 0], "radius_mm": 3.0}}
        other = [dict(first, **other)]
    with pytest.raises(sd.InputError, match=says):
        sd.gym.Env("renal", randomize={"scenario": other}, cache=cache)


def test_a_scenario_or_key_may_stand_alone(cache):
    env = sd.gym.Env("renal", obs="target2d", randomize={"scenario": "renal"}, cache=cache)
    assert list(env.reset(seed=0)[0]) == ["target2d"]
    env = sd.gym.Env("renal", randomize={"scenario": ["renal", "renal_right"]}, cache=cache)
    assert {env.reset(seed=seed) and env.drawn["scenario"] for seed in range(12)} == {"renal", "renal_right"}


def test_every_environment_that_is_listed_names_a_scenario_that_ships():
    for name, arguments in sd.gym.ENVIRONMENTS.items():
        assert arguments["scenario"] in sd.scenarios()
    with pytest.raises(sd.InputError, match="seldinger/Renal-v1"):
        sd.gym.make("Renal-v0")


def test_seeds_draw_the_same_episodes_and_different_ones_others(cache):
    env = sd.gym.make("seldinger/Renal-v1", randomize={"target": "branches", "c_arm.lao_deg": (-5, 5), "c_arm.cranial_deg": (-5, 5)}, cache=cache)
    targets = set()
    for seed in range(4):
        first = run(env, seed, 3)
        targets.add(tuple(env.simulation.target_mm[0]))
        assert run(env, seed, 3) == first
    assert len(targets) == 4
    # Without a seed drawing goes on from the last one, in the same way.
    def two(seed):
        env.reset(seed=seed)
        env.reset()
        return tuple(env.simulation.target_mm[0])
    assert two(9) == two(9) != two(10)


def test_anatomies_are_drawn_from_a_range_of_seeds(cache):
    env = sd.gym.make("seldinger/Renal-v1", randomize={"anatomy.seed": (1, 3)}, cache=cache)
    seen = {}
    for seed in range(8):
        env.reset(seed=seed)
        seen.setdefault(env.drawn["anatomy.seed"], set()).add(int(env.simulation.hashes()[0]))
    assert set(seen) == {1, 2}
    assert all(len(hashes) == 1 for hashes in seen.values())
    assert seen[1] != seen[2]


def test_the_target_ends_an_episode(cache):
    env = begun(sd.gym.Env("s_bend", reward="sparse", cache=cache), seed=2)
    for _ in range(300):
        _, reward, terminated, truncated, info = env.step([[1.0, 0.0]])
        if terminated or truncated:
            break
    assert terminated and not truncated and info["success"] and reward == 1 and info["truncation"] is None
    with pytest.raises(sd.InputError, match="reset"):
        env.step([[0.0, 0.0]])


def test_truncation_names_its_reason(cache):
    env = begun(sd.gym.Env("s_bend", max_episode_steps=3, cache=cache))
    ends = [env.step(np.zeros((1, 2)))[3:] for _ in range(3)]
    assert [end[0] for end in ends] == [False, False, True] and ends[-1][1]["truncation"] == "steps"
    env = begun(sd.gym.Env("s_bend", set={"time_limit_s": 0.4}, cache=cache))
    for _ in range(6):
        *_, truncated, info = env.step(np.zeros((1, 2)))
    assert truncated and info["truncation"] == "time"
    env = begun(sd.gym.Env("s_bend", set={"target.radius_mm": 0.1}, frame_skip=3, cache=cache))
    for _ in range(300):
        *_, truncated, info = env.step([[1.0, 0.0]])
        if truncated:
            break
    assert truncated and info["truncation"] == "vessel_end"


def test_the_route_leads_from_the_tip_to_the_target(cache):
    env = sd.gym.make("seldinger/Renal-v1", cache=cache, obs=("route2d", "route3d", "tip3d", "target3d"), route_points=40,
                      route_spacing_mm=10.0)
    observation, _ = env.reset(seed=3)
    rng = np.random.default_rng(3)
    sim = sd.Simulation("renal", cache=cache)
    for _ in range(60):
        route = observation["route3d"]
        gaps = np.linalg.norm(np.diff(np.vstack([observation["tip3d"], route]), axis=0), axis=1)
        assert gaps[0] < 25 and gaps.max() < 26  # the tip lies beside the centreline
        assert np.linalg.norm(route[-1] - observation["target3d"]) < 2
        ways = [sim.path_from(point) for point in route]
        ahead = [before - after for before, after in zip(ways, ways[1:]) if before > 12]
        # Samples are a millimetre apart, and at the two forks the nearest one may lie in the other vessel.
        assert len(ahead) > 15 and sum(abs(by - 10) > 1.5 for by in ahead) <= 4
        projected = sim.project(route, 128)
        assert np.abs(projected - observation["route2d"]).max() < 0.01
        observation, _, terminated, truncated, _ = env.step(rng.uniform([[0.2, -1]], [[1, 1]]))
        if terminated or truncated:
            observation, _ = env.reset()
    with pytest.raises(sd.InputError, match="route_points: 0 was given"):
        sd.gym.make("seldinger/Renal-v1", cache=cache, route_points=0)
    with pytest.raises(sd.InputError, match="route_spacing_mm: 0 was given"):
        sd.gym.make("seldinger/Renal-v1", cache=cache, route_spacing_mm=0)


def test_actions_are_speeds(cache):
    for action, value in (("velocity", [[1.0, 0.5]]), ("physical", [[35.0, 1.57]])):
        env = begun(sd.gym.Env("renal", action=action, frame_skip=2, cache=cache))
        before = env.simulation.inserted_mm[0, 0]
        env.step(np.array(value))
        assert env.simulation.inserted_mm[0, 0] - before == pytest.approx(35 * 2 / 15, rel=1e-6)
        assert env.simulation.turned_rad[0, 0] == pytest.approx(1.57 * 2 / 15, rel=1e-6)
    flat = sd.gym.Env("renal", flat_action=True, cache=cache)
    assert flat.action_space.shape == (2,)
    flat.reset(seed=0)
    flat.step(np.zeros(2))
    with pytest.raises(sd.InputError, match="not finite"):
        flat.step([np.nan, 0])
    with pytest.raises(sd.InputError, match="shape"):
        flat.step([0, 0, 0])


def test_rewards_are_the_sum_of_their_parts(cache):
    env = begun(sd.gym.Env("renal", reward="path_delta", cache=cache))
    way = env._batch.way()[0]
    _, reward, _, _, info = env.step([[1.0, 0.0]])
    assert info["reward"]["path_delta"] == pytest.approx(0.01 * (way - info["path_to_target_mm"]))
    assert reward == pytest.approx(info["reward"]["path_delta"] - 0.001) and reward > 0
    assert 0 < info["path_ratio"] < 1
    env = begun(sd.gym.Env("renal", reward=lambda info: -info["wall_force_N"], cache=cache))
    _, reward, _, _, info = env.step([[1.0, 0.0]])
    assert reward == pytest.approx(-info["wall_force_N"])


@pytest.mark.parametrize("arguments, says", [
    ({"obs": ("tracking4d",)}, "tracking4d"), ({"obs": ()}, "nothing"), ({"action": "jump"}, "velocity"),
    ({"reward": "praise"}, "path_delta"), ({"randomize": {"weather": 1}}, "weather.*'guidewire.friction'"),
    ({"randomize": {"seed": (5, 5)}}, "seed .5, 5.*whole"), ({"max_episode_steps": 0}, "max_episode_steps"),
    ({"render_mode": "human"}, "rgb_array"), ({"randomize": {"target": "anywhere"}}, "branches"),
    ({"randomize": {"seed": ("a", "b")}}, "two whole numbers"), ({"randomize": {"seed": (0.5, 2)}}, "two whole numbers"),
    ({"randomize": {"seed": (-1, 2)}}, "two whole numbers"), ({"randomize": {"seed": -1}}, "seed"),
    ({"randomize": {"target": 5}}, "a list of branches"), ({"randomize": {"target": []}}, "a list of branches"),
    ({"randomize": {"target": [3]}}, "a list of branches"), ({"randomize": {"target": ["nowhere"]}}, "nowhere.*expected tube"),
    ({"randomize": {"c_arm.lao_deg": "x"}}, "lao_deg"), ({"randomize": {"c_arm.lao_deg": (-5, 500)}}, "lao_deg"),
    ({"randomize": {"c_arm.lao_deg": (5, -5)}}, "low first"), ({"randomize": {"guidewire.friction": (0.1, 7)}}, "friction"),
    ({"randomize": {"guidewire.friction": []}}, "a range"), ({"randomize": {"guidewire.device": ["glide035", "rope"]}}, "rope"),
    ({"randomize": {"frame_rate_hz": (15, 30)}}, "frames a second as they are"),
    ({"randomize": {"c_arm.pixels": [128, 256, 512]}}, "pixels of the C-arm as they are"),
    ({"randomize": {"latency_steps": (0.5, 2)}}, "whole"), ({"randomize": {"latency_steps": -1}}, "0 or more"),
    ({"randomize": {"tracking_noise_mm": (-1, 1)}}, "0 or more"), ({"randomize": {5: 1}}, "a dict of a scenario's keys"),
    ({"stand": "chair"}, "c_arm, table"), ({"stand": 5}, "c_arm, table"), ({"stand": [[]]}, "c_arm, table"),
    ({"stand": ("table", "table")}, "c_arm, table"),
    ({"obs": "catheter_mask"}, "wire_mask"),
    ({"randomize": {"scenario": []}}, "a scenario or a list"), ({"randomize": {"scenario": 5}}, "a scenario or a list"),
    ({"randomize": {"scenario": ["kidney"]}}, "kidney"), ({"randomize": "x"}, "expected a dict"),
    ({"obs": 5}, "obs: 5"), ({"set": [1]}, "a dict of keys"), ({"cache": 5}, "a folder"),
    ({"frame_skip": 10 ** 6 + 1}, "frame_skip.* 1 to 1000000"), ({"frame_skip": 1.5}, "frame_skip"),
    ({"image_size": 31}, "image_size.* 32 to 2048"), ({"image_size": 4096}, "image_size"),
    ({"n_points": 0}, "n_points"), ({"n_points": 1001}, "n_points"), ({"resolution_mm": "x"}, "resolution_mm"),
    ({"resolution_mm": 10 ** 400}, "resolution_mm"),
    ({"resolution_mm": float("nan")}, "resolution_mm"), ({"resolution_mm": 101}, "resolution_mm")])
def test_arguments_that_are_not_accepted_are_named(cache, arguments, says):
    with pytest.raises(sd.InputError, match=says):
        sd.gym.Env("s_bend", **{"cache": cache, **arguments})
    with pytest.raises(sd.InputError, match=says):
        sd.gym.VectorEnv("s_bend", 2, **{"cache": cache, **arguments})


@pytest.mark.parametrize("seed", [-1, 1.5, "3", float("nan"), [1], object()])
def test_seeds_that_are_none_are_refused(cache, seed):
    env = sd.gym.Env("s_bend", cache=cache)
    with pytest.raises(sd.InputError, match="seed: .* a whole number of 0 or more"):
        env.reset(seed=seed)


def test_seeds_of_many_are_one_number_or_a_list(cache):
    many = sd.gym.make_vec("seldinger/Renal-v1", 2, randomize={"target": "branches"}, threads=1, cache=cache)

    def targets(seed):
        many.reset(seed=seed)
        return many.simulation.target_mm.copy()
    first = targets(3)
    for seed in (np.array(3), np.int64(3), [3, 4], (3, np.int64(4)), np.array([3, 4])):
        np.testing.assert_array_equal(targets(seed), first)
    many.reset(seed=[None, 4])
    for seed in (-1, 1.5, "3", "34", [3], [3, -4], [3, 4.5], ["3", "4"], [[3, 4]], {3: 4}, np.array([3.0, 4.0])):
        with pytest.raises(sd.InputError, match="seed: "):
            many.reset(seed=seed)
    for mask in ([1, 0], [True], np.array([0, 1]), "yes"):
        with pytest.raises(sd.InputError, match="reset_mask"):
            many.reset(options={"reset_mask": mask})


@pytest.mark.parametrize("returned", ["3", None, float("nan"), float("inf"), np.array([1, 2]), 1j])
def test_rewards_that_are_no_numbers_are_refused(cache, returned):
    env = begun(sd.gym.Env("s_bend", reward=lambda info: returned, cache=cache))
    with pytest.raises(sd.InputError, match="reward: the callable returned"):
        env.step([[0, 0]])


@pytest.mark.parametrize("action", ["x", None, [1j, 0], [0, 0, 0], [np.nan, 0], [np.inf, 0], [1e300, 0], [["0", "0"]], {}])
def test_actions_that_are_refused_change_nothing(cache, action):
    env = begun(sd.gym.Env("s_bend", max_episode_steps=2, obs="last_action", cache=cache))
    start = env.simulation.hashes()
    with pytest.raises(sd.InputError, match="action: "):
        env.step(action)
    assert env.simulation.hashes() == start
    assert not env.step([[0, 0]])[3]


def test_an_action_that_is_refused_does_not_use_up_the_next_episode(cache):
    many = begun(sd.gym.VectorEnv("s_bend", 2, threads=1, max_episode_steps=2, cache=cache), seed=1)
    start = many.simulation.hashes()
    push = np.full((2, 1, 2), 0.3, np.float32)
    many.step(push)
    assert many.step(push)[3].all()
    ended = many.simulation.hashes()
    with pytest.raises(sd.InputError, match="shape"):
        many.step(np.zeros((3, 1, 2)))
    assert (many.simulation.hashes() == ended).all()
    _, rewards, _, _, _ = many.step(push)
    assert (many.simulation.hashes() == start).all() and (rewards == 0).all()


def test_closed_environments_say_so(cache):
    env = begun(sd.gym.Env("s_bend", render_mode="rgb_array", randomize={"target": "branches"}, cache=cache))
    env.close()
    env.close()
    many = begun(sd.gym.VectorEnv("s_bend", 2, threads=1, cache=cache))
    many.close()
    for call in (lambda: env.step([[0, 0]]), lambda: env.reset(seed=0), env.render,
                 lambda: many.step(np.zeros((2, 1, 2))), lambda: many.reset(seed=0)):
        with pytest.raises(sd.InputError, match="closed"):
            call()


def together(infos, n):
    """Infos of single environments, by their index, as gymnasium's VectorEnv puts them together: numbers in arrays of the type
    that NumPy makes of theirs, whole ones in int64, arrays in higher ones, anything else as objects."""
    made = {}
    for i, info in infos.items():
        for key, value in info.items():
            mask = made.setdefault("_" + key, np.zeros(n, bool))
            mask[i] = True
            if isinstance(value, dict):
                made[key] = together({k: infos[k][key] for k in infos if key in infos[k]}, n)
                continue
            if key not in made:
                if type(value) in (int, float, bool) or isinstance(value, np.number):
                    made[key] = np.zeros(n, type(value))
                elif isinstance(value, np.ndarray):
                    made[key] = np.zeros((n, *value.shape), value.dtype)
                else:
                    made[key] = np.full(n, None, object)
            made[key][i] = value
    return made


def assert_same(given, expected, where="info"):
    assert given.keys() == expected.keys(), where
    for key, value in expected.items():
        if isinstance(value, dict):
            assert_same(given[key], value, f"{where}.{key}")
        else:
            value = np.asarray(value)
            assert given[key].dtype == value.dtype, f"{where}.{key}: {given[key].dtype}, {value.dtype}"
            np.testing.assert_array_equal(given[key], value, err_msg=f"{where}.{key}")


def test_hashes_of_infos_are_signed_numbers_that_cover_target_stand_and_what_is_drawn(cache):
    env = sd.gym.make("seldinger/Renal-v1", cache=cache)
    _, info = env.reset(seed=0)
    signs = set()
    for k in range(20):
        assert type(info["hash"]) is int and np.zeros(1, int).dtype == np.array([info["hash"]]).dtype
        signs.add(info["hash"] < 0)
        info = env.step([[0.3, 0.1 * k]])[4]
    assert signs == {True, False}
    first = env.reset(seed=3)[1]["hash"]
    state = env.simulation.hashes()
    for options in ({"target": "RRA"}, {"target": env.simulation.tip_mm[0]}, {"set": {"c_arm.lao_deg": 10}},
                    {"set": {"guidewire.friction": 0.05}}):
        assert env.reset(seed=3, options=options)[1]["hash"] != first, options
        if "guidewire.friction" not in options.get("set", {}):
            assert env.simulation.hashes() == state, options
    assert env.reset(seed=3)[1]["hash"] == first != env.reset(seed=4)[1]["hash"]


@pytest.mark.parametrize("shape", [(2, 1), (2,), (1, 1, 2), (1, 2, 1), (4,), (), (0,), (1, 4), (2, 2)])
def test_actions_of_another_shape_are_refused(cache, shape):
    env = begun(sd.gym.Env("s_bend", cache=cache))
    start = env.simulation.hashes()
    with pytest.raises(sd.InputError, match=re.escape(f"action: expected shape (1, 2), found {shape}")):
        env.step(np.zeros(shape, np.float32))
    assert env.simulation.hashes() == start
    env.step(np.zeros((1, 2)))


@pytest.mark.parametrize("shape", [(2, 3), (2, 3, 1), (3, 2), (3, 2, 1), (1, 3, 2), (2, 1, 3), (6,), (3, 1, 2, 1)])
def test_actions_of_many_in_another_shape_are_refused(cache, shape):
    many = begun(sd.gym.VectorEnv("s_bend", 3, threads=1, cache=cache))
    before = many.simulation.hashes()
    with pytest.raises(sd.InputError, match=re.escape(f"action: expected shape (3, 1, 2), found {shape}")):
        many.step(np.zeros(shape, np.float32))
    assert (many.simulation.hashes() == before).all()
    alone = begun(sd.gym.VectorEnv("s_bend", 1, threads=1, cache=cache))
    with pytest.raises(sd.InputError, match=re.escape("expected shape (1, 1, 2), found (1, 2)")):
        alone.step(np.zeros((1, 2)))


def test_the_arguments_of_environments_are_shown_and_others_refused(cache):
    for of, own in ((sd.gym.Env, {"scenario"}), (sd.gym.VectorEnv, {"scenario", "num_envs", "threads", "autoreset"})):
        shown = inspect.signature(of).parameters
        assert own < set(shown) and {"obs", "reward", "max_episode_steps", "beam", "render_mode", "stand"} < set(shown)
        assert shown["frame_skip"].default == 1
        with pytest.raises(TypeError):
            of("s_bend", cache=cache, nothing=1)
    with pytest.raises(TypeError):
        sd.gym.Env("s_bend", cache=cache, threads=2)


def test_infos_of_many_are_put_together_as_gymnasiums(cache):
    arguments = dict(max_episode_steps=4, cache=cache, randomize={"target": "branches"})
    many = sd.gym.make_vec("seldinger/Renal-v1", 3, threads=2, autoreset="SAME_STEP", **arguments)
    alone = [sd.gym.make("seldinger/Renal-v1", **arguments) for _ in range(3)]
    _, infos = many.reset(seed=5)
    assert_same(infos, together({i: env.reset(seed=5 + i)[1] for i, env in enumerate(alone)}, 3))
    # One environment begins anew after two steps, so that they end at different times.
    for k in range(9):
        actions = np.full((3, 1, 2), 0.1 * k, np.float32)
        observations, rewards, terminated, truncated, infos = many.step(actions)
        last, now, parts, final_obs = {}, {}, {}, {}
        for i, env in enumerate(alone):
            observation, reward, ended, cut, now[i] = env.step(actions[i])
            assert (reward, ended, cut) == (rewards[i], terminated[i], truncated[i])
            parts[i] = now[i]["reward"]
            if ended or cut:
                last[i], final_obs[i] = now[i], observation
                now[i] = dict(env.reset()[1], reward=parts[i])
        expected = together(now, 3)
        if last:
            for i in range(3):
                assert infos["_final_obs"][i] == (i in last)
                for key in final_obs.get(i, ()):
                    np.testing.assert_array_equal(infos["final_obs"][i][key], final_obs[i][key])
            expected.update(final_info=together(last, 3), _final_info=[i in last for i in range(3)],
                            final_obs=infos["final_obs"], _final_obs=infos["_final_obs"])
            got = infos.pop("final_obs"), expected.pop("final_obs")
            assert got[0].dtype == object
        assert_same(infos, expected)
        if k == 1:
            _, infos = many.reset(options={"reset_mask": np.array([False, True, False])})
            assert_same(infos, together({1: alone[1].reset()[1]}, 3))


def test_the_panel_shows_the_image_with_its_readouts(cache):
    env = begun(sd.gym.make("seldinger/Renal-v1", render_mode="panel", cache=cache), seed=1)
    first = env.render()
    assert first.shape == (1024, 1280, 3) and first.dtype == np.uint8
    for _ in range(5):
        env.step(np.ones(env.action_space.shape, np.float32))
    later = env.render()
    assert (first[:, 1024:] != later[:, 1024:]).any(), "the readouts stay as they were"
    assert later[:, :1024].std() > 10, "there is no image"
    # The same episode gives the same panel: its readouts are part of the state.
    env.reset(seed=1)
    assert np.array_equal(env.render(), first)
    for _ in range(5):
        env.step(np.ones(env.action_space.shape, np.float32))
    assert np.array_equal(env.render(), later)


def test_dose_is_measured_with_the_beam_on_and_is_that_of_a_run(cache, tmp_path):
    env = sd.gym.make("seldinger/Renal-v1", beam=True, cache=cache)
    _, info = env.reset(seed=1)
    assert info["dose"] == {"air_kerma_mGy": 0.0, "area_product_Gycm2": 0.0}
    doses = []
    for _ in range(15):
        info = env.step(np.ones(env.action_space.shape, np.float32))[4]
        doses.append(info["dose"]["air_kerma_mGy"])
    assert doses[-1] > 0 and doses == sorted(doses)
    env.simulation.save(0, tmp_path / "x.gw")
    with sd.Simulation("renal", images="dose", cache=cache) as sim:
        sim.apply("beam on")
        for _ in range(15):
            state = sim.step(35 / 15, np.rad2deg(3.14) / 15)
        assert state.air_kerma_mGy == pytest.approx(doses[-1], rel=1e-6)
        assert sim.score()["air_kerma_mGy"] == pytest.approx(state.air_kerma_mGy)
    env.reset()
    assert env.step(np.zeros(env.action_space.shape, np.float32))[4]["dose"]["air_kerma_mGy"] < doses[-1]
    without = begun(sd.gym.make("seldinger/Renal-v1", cache=cache), seed=1)
    assert without.step(np.ones(without.action_space.shape, np.float32))[4]["dose"]["air_kerma_mGy"] == 0


def test_render_gives_a_picture(cache):
    env = begun(sd.gym.Env("s_bend", render_mode="rgb_array", image_size=40, cache=cache))
    picture = env.render()
    assert picture.shape == (40, 40, 3) and picture.dtype == np.uint8 and picture.std() > 1


def test_many_environments_do_as_each_alone(cache):
    arguments = dict(obs=("tracking3d", "force"), randomize={"target": "branches"}, max_episode_steps=50, cache=cache)
    many = sd.gym.make_vec("seldinger/Renal-v1", 3, threads=2, **arguments)
    observations, infos = many.reset(seed=20)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (6, 3, 1, 2)).astype(np.float32)
    for k in range(6):
        observations, rewards, _, _, infos = many.step(actions[k])
    for i in range(3):
        alone = sd.gym.make("seldinger/Renal-v1", **arguments)
        alone.reset(seed=20 + i)
        for k in range(6):
            observation, reward, _, _, info = alone.step(actions[k, i])
        assert info["hash"] == infos["hash"][i] and reward == rewards[i]
        for key in observation:
            np.testing.assert_array_equal(observation[key], observations[key][i])
    assert many.observation_space.contains(observations)


@pytest.mark.parametrize("autoreset", sd.gym.AUTORESET)
def test_autoreset_begins_the_next_episode_when_it_should(cache, autoreset):
    many = sd.gym.VectorEnv("s_bend", 2, threads=1, autoreset=autoreset, max_episode_steps=2, cache=cache)
    with pytest.raises(sd.InputError, match="reset"):
        many.step(np.zeros((2, 1, 2)))
    many.reset(seed=1)
    start = many.simulation.hashes()
    push = np.full((2, 1, 2), 0.3, np.float32)
    many.step(push)
    _, rewards, _, truncated, info = many.step(push)
    assert truncated.all()
    if autoreset == "SAME_STEP":
        assert (many.simulation.hashes() == start).all()
        assert info["final_info"]["truncation"].tolist() == ["steps", "steps"] and "tracking2d" in info["final_obs"][1]
        assert info["_final_info"].all() and info["truncation"].tolist() == [None, None]
        assert not many.step(push)[3].any()
        return
    assert (many.simulation.hashes() != start).all()
    if autoreset == "NEXT_STEP":
        _, rewards, terminated, truncated, _ = many.step(push)
        assert (many.simulation.hashes() == start).all()
        assert (rewards == 0).all() and not truncated.any() and not terminated.any()
        return
    with pytest.raises(sd.InputError, match="reset"):
        many.step(push)
    many.reset(options={"reset_mask": np.array([True, False])})
    assert (many.simulation.hashes() == start).tolist() == [True, False]
    with pytest.raises(sd.InputError, match="reset"):
        many.step(push)


def test_episodes_are_the_same_for_one_and_two_threads(cache):
    def hashes(threads):
        many = sd.gym.make_vec("seldinger/Renal-v1", 8, threads=threads, max_episode_steps=5, cache=cache,
                               randomize={"target": "branches", "c_arm.lao_deg": (-5, 5), "c_arm.cranial_deg": (-5, 5)})
        many.reset(seed=100)
        rng = np.random.default_rng(2)
        return np.array([many.step(rng.uniform(-1, 1, (8, 1, 2)).astype(np.float32))[4]["hash"] for _ in range(14)])
    np.testing.assert_array_equal(hashes(1), hashes(2))
