"""What an episode of an environment begins with and can go back to: draws by key, curricula, options, snapshots, copies, the
stand, and every device."""

import copy
import json
import os
import pickle
import random

import numpy as np
import pytest

import seldinger as sd
from seldinger.gym import batch
from seldinger.gym.draws import drawn

SEED = int(os.environ.get("SELDINGER_TEST_SEED", random.randrange(10 ** 6)))
NUMBERS = [key for key in sd.gym.KEYS if key not in ("image", "guidewire", "phantom")]
RANGES = {"target": "branches", "c_arm.lao_deg": (-15, 15), "latency_steps": (0, 3), "tracking_noise_mm": (0, 1),
          "guidewire.friction": [0.04, 0.08], "seed": (0, 9)}


def assert_same(a, b):
    """Observations, rewards, ends and infos."""
    assert a[1:-1] == b[1:-1] and json.dumps(a[-1]) == json.dumps(b[-1])
    assert a[0].keys() == b[0].keys()
    for key, value in a[0].items():
        np.testing.assert_array_equal(value, b[0][key], err_msg=key)


def follow(env, actions):
    """Steps, and resets where an episode is over."""
    return [env.reset() if env._batch.done[0] else env.step(action) for action in actions]


@pytest.mark.parametrize("name", ["seldinger/Renal-v1", "seldinger/DualDevice-v1"])
def test_any_moment_of_an_environment_can_be_kept_copied_pickled_and_gone_back_to(cache, name):
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    arguments = dict(obs=[*NUMBERS, "wire_tracking3d"], stand=("c_arm", "table"), randomize=RANGES, max_episode_steps=9, cache=cache)
    env, other = sd.gym.make(name, **arguments), sd.gym.make(name, **arguments)
    many = sd.gym.make_vec(name, 2, threads=1, **arguments)
    env.reset(seed=SEED)
    many.reset(seed=SEED)
    other.reset(seed=SEED + 1)
    for k in range(40):
        follow(env, rng.uniform(-1, 1, (rng.integers(4), *env.action_space.shape)))
        if k % 5 == 0:
            env.reset(options=[{"target": "RRA"}, {"start": env.snapshot()}, {"set": {"guidewire.friction": 0.1}}][k // 5 % 3])
        actions = rng.uniform(-1, 1, (int(rng.integers(1, 4)), *env.action_space.shape))
        kept, now = env.snapshot(), env._seen()
        expected = follow(env, actions)
        twins = [(other, pickle.loads(pickle.dumps(kept))), (env, copy.deepcopy(kept)), (env, kept)]
        for twin, snapshot in twins:
            assert_same(twin.restore(snapshot), now)
            for a, b in zip(follow(twin, actions), expected):
                assert_same(a, b)
        env.restore(kept)
        for twin in [copy.deepcopy(env)] + ([pickle.loads(pickle.dumps(env))] if k % 10 == 0 else []):
            assert twin.drawn == env.drawn
            for a, b in zip(follow(twin, actions), expected):
                assert_same(a, b)
        many.restore(1, kept)
        if not many._batch.done.any():
            both = np.zeros(many.action_space.shape)
            both[1] = actions[0]
            observation, rewards, _, _, infos = many.step(both)
            assert rewards[1] == expected[0][1] and infos["hash"][1] == expected[0][4]["hash"]
            assert all(np.array_equal(value[1], expected[0][0][key]) for key, value in observation.items())
    assert repr(kept).startswith("<EnvSnapshot after ") and name in repr(kept.like) or "renal" in repr(kept.like)


def test_vector_environments_are_copied_and_pickled(cache):
    many = sd.gym.make_vec("seldinger/Renal-v1", 3, threads=2, randomize=RANGES, max_episode_steps=4, autoreset="SAME_STEP",
                           cache=cache)
    many.reset(seed=5)
    action = np.full(many.action_space.shape, 0.4)
    many.step(action)
    twins = [copy.deepcopy(many), pickle.loads(pickle.dumps(many))]
    for _ in range(7):
        _, rewards, _, truncated, infos = many.step(action)
        for twin in twins:
            result = twin.step(action)
            assert (result[1] == rewards).all() and (result[3] == truncated).all() and (result[4]["hash"] == infos["hash"]).all()
    assert "x 3: obs tracking2d" in repr(many)
    with pytest.raises(IndexError):
        many.snapshot(3)


def test_snapshots_of_other_environments_are_refused_and_change_nothing(cache):
    renal = sd.gym.make("seldinger/Renal-v1", cache=cache)
    renal.reset(seed=1)
    before = renal.snapshot()
    others = [sd.gym.make("seldinger/DualDevice-v1", cache=cache), sd.gym.make("seldinger/Renal-v1", n_points=5, cache=cache),
              sd.gym.make("seldinger/Renal-v1", stand="table", cache=cache)]
    for other in others:
        other.reset(seed=1)
        with pytest.raises(sd.InputError, match="a snapshot of an environment with"):
            renal.restore(other.snapshot())
    for wrong in (None, renal.simulation.snapshot(0), {"steps": 3}):
        with pytest.raises(sd.InputError, match="snapshot"):
            renal.restore(wrong)
    assert_same(renal._seen(), renal.restore(before))
    renal.close()
    for call in (renal.snapshot, lambda: renal.restore(before), renal._repr_png_):
        with pytest.raises(sd.InputError, match="closed"):
            call()
    assert "closed" in repr(renal)


def test_a_snapshot_goes_back_from_another_anatomy_and_to_one(cache):
    env = sd.gym.make("seldinger/Renal-v1", randomize={"anatomy.seed": (1, 3)}, pool_size=1, cache=cache)
    kept = {}
    for seed in range(6):
        env.reset(seed=seed)
        kept.setdefault(env.drawn["anatomy.seed"], (env.snapshot(), env.step([[1, 0]])))
    assert set(kept) == {1, 2}
    for snapshot, result in list(kept.values()) * 2:
        env.restore(pickle.loads(pickle.dumps(snapshot)))
        assert_same(env.step([[1, 0]]), result)


@pytest.mark.parametrize("options, says", [
    (5, "options: 5 was given; expected a dict of seed, target, start, set"), ("x", "a dict"), ({"targets": 1}, "'targets' was found"),
    ({"reset_mask": [True]}, "'reset_mask' was found"), ({"target": "XYZ"}, "target 'XYZ' was given; expected .*RRA"),
    ({"target": [0, 0, 9000]}, "outside"), ({"target": 5}, "target"), ({"target": None}, "target"), ({"seed": -1}, "seed"),
    ({"start": "x"}, "start 'x' was given"), ({"start": {"sheath": 5}}, "start of 'sheath'.*expected wire"),
    ({"start": -5}, "inserted_mm"), ({"start": float("nan")}, "start"), ({"start": {"wire": "long"}}, "start"), ({"set": 5}, "set 5"),
    ({"set": {"guidewire.frictoin": 0.1}}, "frictoin"), ({"set": {"guidewire.friction": 9}}, "friction"),
    ({"set": {"frame_rate_hz": 30}}, "frames a second as they are"), ({"set": {"scenario": "renal"}}, "scenario")])
def test_options_that_are_not_known_or_not_accepted_are_named(cache, options, says):
    env = sd.gym.make("seldinger/Renal-v1", cache=cache)
    first = env.reset(seed=3)
    with pytest.raises(sd.InputError, match=says):
        env.reset(seed=1, options=options)
    assert_same(env.reset(seed=3), first)
    with pytest.raises(sd.InputError):
        sd.gym.make_vec("seldinger/Renal-v1", 2, threads=1, cache=cache).reset(options=options)


def test_options_set_target_start_values_and_seed_of_one_episode(cache):
    env = sd.gym.make("seldinger/DualDevice-v1", randomize={"target": "branches", "guidewire.friction": (0.02, 0.03)}, cache=cache)
    first = env.reset(seed=7)[1]
    assert env.reset(options={"seed": 7})[1] == first != env.reset(options={"seed": 8})[1]
    by_name = env.reset(seed=7, options={"target": "RRA"})[1]
    place = env.simulation.target_mm[0].copy()
    assert env.reset(seed=7, options={"target": place})[1]["tip_to_target_mm"] == pytest.approx(by_name["tip_to_target_mm"])
    places = set()
    for seed in range(3):
        env.reset(seed=seed, options={"target": "aorta+LCIA+LEIA+LCFA"})
        places.add(tuple(env.simulation.target_mm[0]))
    assert len(places) == 3
    env.reset(seed=7, options={"set": {"guidewire.friction": 0.5, "c_arm.lao_deg": 30}})
    assert env.drawn["guidewire.friction"] == 0.5 and env.simulation.c_arm_deg[0, 0] == pytest.approx(30)
    lengths = env.reset(seed=7, options={"start": {"wire": 200, "catheter": 190}})[1]["inserted_mm"]
    assert lengths == pytest.approx({"wire": 200, "catheter": 190}, abs=0.01)
    assert env.reset(seed=7)[1] == first
    wire = sd.gym.make("seldinger/Renal-v1", cache=cache)
    assert wire.reset(options={"start": 120})[1]["inserted_mm"]["wire"] == pytest.approx(120, abs=0.01)


def test_an_episode_may_begin_where_another_was(cache):
    env = sd.gym.make("seldinger/Renal-v1", max_episode_steps=3, cache=cache)
    env.reset(seed=1)
    for _ in range(2):
        env.step([[1, 0.5]])
    kept, tip = env.snapshot(), env.simulation.tip_mm[0].copy()
    info = env.reset(options={"start": kept})[1]
    np.testing.assert_array_equal(env.simulation.tip_mm[0], tip)
    assert info["path_ratio"] == 1 and [env.step([[0, 0]])[3] for _ in range(3)] == [False, False, True]
    with pytest.raises(sd.InputError, match="a snapshot as start"):
        env.reset(options={"start": kept, "target": "RRA"})
    with pytest.raises(sd.InputError, match="reset"):
        env.step([[0, 0]])
    env.reset()


@pytest.mark.parametrize("value, holds", [
    ((0.1, 0.2), lambda x: 0.1 <= x < 0.2), ([0.1, 0.2], lambda x: 0.1 <= x < 0.2), ([1, 2, 3], lambda x: x in (1, 2, 3)),
    (["a", "b"], lambda x: x in ("a", "b")), (([0, 1], [0, 5]), lambda x: x[0] == 0 and 1 <= x[1] < 5), (7, lambda x: x == 7),
    (lambda rng: rng.choice(4), lambda x: x in range(4)), ([[], [{"percent": (30, 70), "branch": ["LRA", "RRA"]}]],
     lambda x: x == [] or (30 <= x[0]["percent"] < 70 and x[0]["branch"] in ("LRA", "RRA"))), ([True, False], lambda x: x in (True, False))])
def test_ranges_choices_and_callables_are_drawn(value, holds):
    rng = np.random.default_rng(SEED)
    made = [drawn("x", value, rng) for _ in range(50)]
    assert all(holds(one) for one in made), (SEED, made)
    assert value == 7 or len({str(one) for one in made}) > 1
    assert {drawn("anatomy.seed", (3, 5), rng) for _ in range(50)} == {3, 4}


@pytest.mark.parametrize("ranges", [
    {"anatomy.stenosis": [[], [{"branch": ["LRA", "RRA"], "at_mm": 8, "length_mm": 6, "percent": (30, 70)}]]},
    {"entry.inserted_mm": (60, 120), "guidewire.roll_deg": (-180, 180)}, {"guidewire.device": ["glide035", "bentson035"]},
    {"guidewire.shaft_rigidity_N_mm2": (150, 350), "guidewire.friction": (0.02, 0.12)}, {"imaging.detector_dose_nGy": (10, 60)},
    {"motion.breathing_rate_per_min": (10, 18), "motion.breathing_reach_mm": ([0, 1, -4], [0, 2, -10])},
    {"anatomy.age": (40, 90), "anatomy.sex": ["f", "m"]}], ids=lambda ranges: next(iter(ranges)))
def test_what_a_policy_must_not_depend_on_is_drawn_and_has_an_effect(cache, ranges):
    obs = {"imaging.detector_dose_nGy": "image", "anatomy.stenosis": "phantom"}.get(next(iter(ranges)), "tracking3d")
    env = sd.gym.make("seldinger/Renal-v1", obs=obs, image_size=1024 if obs == "phantom" else 32, randomize=ranges, cache=cache)
    seen, draws, hashes = set(), set(), set()
    for seed in (1, 2, 3, 1):  # fixed, so that their vessels are grown once
        env.reset(seed=seed)
        for _ in range(6):
            observation, *_, info = env.step([[1, 0.7]])
        seen.add(observation[obs].tobytes())
        draws.add(str({key: env.drawn[key] for key in ranges}))
        hashes.add(info["hash"])
    assert 1 < len(draws) == len(seen) <= len(hashes) == 3, draws


def test_a_curriculum_gets_what_was_and_gives_the_next_ranges(cache):
    said = []

    def curriculum(so_far):
        said.append(dict(so_far))
        return {"target": ["LRA"] if so_far["episodes"] < 2 else ["RRA"], "seed": so_far["episodes"]}
    env = sd.gym.Env("renal", max_episode_steps=2, randomize=curriculum, cache=cache)
    branches = []
    for _ in range(4):
        env.reset(options={"seed": 3})
        branches.append(env.simulation.target_mm[0, 0] > 0)
        while not env._batch.done[0]:
            env.step([[0, 0]])
    assert branches == [True, True, False, False]
    assert [one["episodes"] for one in said] == [0, 1, 2, 3] and [one["steps"] for one in said] == [0, 2, 4, 6]
    assert all(one["success_rate"] == 0 for one in said) and env.drawn["seed"] == 3
    near = sd.gym.Env("renal", randomize=lambda so_far: said.append(so_far) or {}, cache=cache)
    for _ in range(3):
        near.reset()
        near.reset(options={"target": near.simulation.tip_mm[0]})
        near.step([[0, 0]])
    near.reset()
    assert said[-1]["success_rate"] == 1 and said[-1]["episodes"] == 3
    with pytest.raises(sd.InputError, match="weather"):
        sd.gym.Env("renal", randomize=lambda so_far: {"weather": 1}, cache=cache).reset()
    near.randomize = {"target": ["RRA"]}
    near.reset()
    assert near.simulation.target_mm[0, 0] < 0
    with pytest.raises(sd.InputError, match="weather"):
        near.randomize = {"weather": 1}
    assert near.randomize == {"target": ["RRA"]}


def test_draws_that_fit_no_vessels_are_drawn_anew_and_in_the_end_refused(cache):
    env = sd.gym.Env("renal", randomize={"entry.inserted_mm": [80, 1500, 80]}, cache=cache)
    for seed in range(6):
        env.reset(seed=seed)
        assert env.drawn["entry.inserted_mm"] == 80
    env = sd.gym.Env("renal", randomize={"entry.inserted_mm": (1400, 1500)}, cache=cache)
    with pytest.raises(sd.InputError, match="none of 50 draws fits"):
        env.reset()
    with pytest.raises(sd.InputError, match="reset"):
        env.step([[0, 0]])


def test_actions_wait_as_long_as_latency_says(cache):
    def lengths(latency):
        env = sd.gym.Env("s_bend", obs=("inserted_length", "last_action"), randomize={"latency_steps": latency}, cache=cache)
        observation, _ = env.reset(seed=1)
        made = [observation["inserted_length"][0]]
        for action in (1, 0.5, 0, 0, 0):
            observation = env.step([[action, 0]])[0]
            assert observation["last_action"][0, 0] == action
            made.append(observation["inserted_length"][0])
        return np.round(np.diff(made) * 15 / 35, 4).tolist()
    assert lengths(0) == [1, 0.5, 0, 0, 0] and lengths(2) == [0, 0, 1, 0.5, 0]


def test_noise_of_what_is_tracked_has_its_size_and_leaves_the_state_alone(cache):
    obs = ("tracking3d", "tracking2d", "tip3d", "target3d")
    quiet, noisy = (sd.gym.Env("s_bend", obs=obs, image_size=512, n_points=200, randomize={"tracking_noise_mm": size}, cache=cache)
                    for size in (0, 2))
    for seed in (1, 2):
        a, b = (env.reset(seed=seed)[0] for env in (quiet, noisy))
    a, b = (env.step([[1, 0]])[0] for env in (quiet, noisy))
    away = b["tracking3d"] - a["tracking3d"]
    assert away.std() == pytest.approx(2, rel=0.15) and abs(away.mean()) < 0.4
    per_mm = 512 / quiet._batch.about["field_mm"]
    np.testing.assert_allclose(b["tracking2d"] - a["tracking2d"], away[:, :2] * per_mm, atol=0.01)
    np.testing.assert_array_equal(b["tip3d"][0], b["tracking3d"][0])
    np.testing.assert_array_equal(a["target3d"], b["target3d"])
    assert quiet.simulation.hashes() == noisy.simulation.hashes()


@pytest.mark.parametrize("name", ["seldinger/DualDevice-v1", "seldinger/Crossover-v1", "seldinger/Carotid-v1"])
def test_every_device_is_in_the_observation(cache, name):
    devices = ("wire", "catheter")
    obs = ["tracking2d", "tracking3d", "tip2d", "tip3d", "guidewire", "phantom"] + \
        [f"{device}_{part}" for device in devices for part in ("tracking2d", "tracking3d", "mask")]
    env = sd.gym.make(name, obs=obs, image_size=256, cache=cache)
    env.reset(seed=1)
    for _ in range(8):
        observation, *_, info = env.step([[0.6, 0.2], [0.3, -0.4]])
    by = env._batch.about["target_by"]
    for kind in ("tracking2d", "tracking3d"):
        np.testing.assert_array_equal(observation[kind], observation[f"{by}_{kind}"])
        other = observation[f"{devices[1 - devices.index(by)]}_{kind}"]
        assert np.abs(other - observation[kind]).max() > 1
    np.testing.assert_array_equal(observation["guidewire"], observation["wire_mask"])
    for k, device in enumerate(devices):
        tip = observation["tip2d"][k]
        np.testing.assert_array_equal(tip, observation[f"{device}_tracking2d"][0])
        np.testing.assert_array_equal(observation["tip3d"][k], observation[f"{device}_tracking3d"][0])
        if (tip > 2).all() and (tip < 254).all():  # the mask ends where the tip is
            rows, columns = np.nonzero(observation[f"{device}_mask"][..., 0])
            assert np.hypot(columns + 0.5 - tip[0], rows + 0.5 - tip[1]).min() < 3, device
    assert set(info["inserted_mm"]) == set(info["push_N"]) == set(info["torque_Nmm"]) == set(devices)
    assert env.observation_space.contains(observation) and json.loads(json.dumps(info)) == info
    assert set(sd.gym.make(name, cache=cache).observation_space.spaces) > {"tracking2d"}


def test_a_device_that_is_out_is_at_the_introducer(cache):
    env = sd.gym.Env("renal_cobra", obs=("wire_tracking3d", "catheter_tracking3d", "tip2d"), set={"catheter.inserted_mm": 0},
                     cache=cache)
    observation, info = env.reset(seed=0)
    assert info["inserted_mm"]["catheter"] == 0 and env.observation_space.contains(observation)
    with sd.Simulation("renal_cobra", set={"catheter.inserted_mm": 0}, cache=cache) as sim:
        np.testing.assert_allclose(observation["catheter_tracking3d"], np.tile(sim.state.wire_mm[0], (3, 1)), atol=1e-3)


def test_table_and_c_arm_are_moved_where_asked(cache):
    obs = ("c_arm", "table", "target2d", "target3d", "last_action")
    env = sd.gym.make("seldinger/Renal-v1", obs=obs, stand=("c_arm", "table"), cache=cache)
    first, _ = env.reset(seed=0)
    assert env.action_space.shape == (3, 2) and not first["c_arm"].any() and not first["table"].any()
    for _ in range(15):
        observation = env.step([[0, 0], [1, -0.5], [0.5, -1]])[0]
    np.testing.assert_allclose(observation["c_arm"], [20, -10], atol=1e-3)
    np.testing.assert_allclose(observation["table"], [50, 0, -100], atol=1e-3)
    assert np.abs(observation["target2d"] - first["target2d"]).max() > 20
    np.testing.assert_array_equal(observation["target3d"], first["target3d"])
    np.testing.assert_array_equal(observation["last_action"][1:], [[1, -0.5], [0.5, -1]])
    for _ in range(150):  # to the ends of both
        env.step([[0, 0], [1, 1], [1, 1]])
        if env._batch.done[0]:
            break
    assert env._batch.sim.c_arm_deg[0].tolist() == pytest.approx([120, 45]) and env._batch.sim.table_mm[0, 0] == pytest.approx(180)
    flat = sd.gym.make("seldinger/Renal-v1", stand="table", flat_action=True, action="physical", cache=cache)
    assert flat.action_space.shape == (4,) and flat.action_space.high.tolist() == pytest.approx([35, 3.14, 100, 100])
    flat.reset()
    flat.step([0, 0, -30, 15])
    assert flat.simulation.table_mm[0].tolist() == pytest.approx([-2, 0, 1])
    still = sd.gym.make("seldinger/Renal-v1", cache=cache)
    still.reset(seed=0)
    env.reset(seed=0)
    for _ in range(3):
        a, b = still.step([[1, 0.2]])[4], env.step([[1, 0.2], [0, 0], [0, 0]])[4]
    assert a["hash"] == b["hash"]


@pytest.mark.parametrize("name", sd.gym.ENVIRONMENTS)
def test_no_environment_begins_with_the_tip_outside_the_image(cache, name):
    angles = {"c_arm.lao_deg": (-60, 60), "c_arm.cranial_deg": (-30, 30)}
    env = sd.gym.make(name, randomize=angles, cache=cache)
    for seed in range(SEED, SEED + 15):
        env.reset(seed=seed)
        assert (0 <= env.simulation.tip_px[0]).all() and (env.simulation.tip_px[0] < env._batch.about["pixels"]).all(), seed
        env.step(np.zeros(env.action_space.shape))
        assert (0 <= env.simulation.tip_px[0]).all() and (env.simulation.tip_px[0] < env._batch.about["pixels"]).all(), seed
    assert not sd.gym.make("seldinger/Renal-v1", cache=cache).reset(seed=0)[1]["truncation"]


@pytest.mark.parametrize("name", ["seldinger/Renal-v1", "seldinger/Carotid-v1", "seldinger/DualDevice-v1"])
def test_other_patients_have_the_target_in_its_branch(cache, name):
    """Of a wire and of catheters; the targets of the latter are places, which other vessels need not hold."""
    env = sd.gym.make(name, randomize={"anatomy.seed": (1, 2)}, hashes=False, cache=cache)
    for seed in range(2):
        env.reset(seed=seed)
        branch = batch._along_of_target(sd.Simulation(env.drawn["scenario"], images=False, cache=cache))[0]
        target = env.simulation.target_mm[0]
        place = next(one for one in env._batch.sim.likes[0].anatomy()["branches"] if one["name"] == branch)
        assert np.linalg.norm(place["points_mm"] - target, axis=1).min() < 1e-3, (seed, env.drawn)
        assert env.drawn["anatomy.seed"] == 1 and "target.name" not in env.drawn


def test_a_target_by_name_takes_the_place_of_one_by_coordinates(cache):
    for scenario, values, near in (("renal_cobra", {"target.name": "LRA"}, "LRA"),
                                   ("renal", {"target.centre_mm": [0.0, 0.0, 60.0]}, [0, 0, 60])):
        with sd.Simulation(scenario, set=values, images=False, cache=cache) as sim:
            if near == "LRA":
                near = next(one["centre_mm"] for one in sim.anatomy()["targets"] if one["name"] == "LRA")
            assert sim.state.target_mm == pytest.approx(near)
    with pytest.raises(sd.InputError, match="either 'name' or 'centre_mm'"):
        sd.Simulation("renal", set={"target.name": "LRA", "target": {"name": "LRA", "centre_mm": [0, 0, 0]}}, images=False)


def test_frames_of_a_video_come_at_the_rate_of_steps(cache):
    for skip, rate in ((1, 15), (3, 5), (2, 7.5)):
        env = sd.gym.Env("s_bend", frame_skip=skip, cache=cache)
        assert env.metadata["render_fps"] == rate and sd.gym.Env.metadata["render_fps"] == 15
        assert sd.gym.VectorEnv("s_bend", 2, threads=1, frame_skip=skip, cache=cache).metadata["render_fps"] == rate


def test_many_environments_render_each(cache):
    many = sd.gym.VectorEnv("s_bend", 2, threads=1, render_mode="rgb_array", image_size=40, cache=cache)
    many.reset(seed=1)
    alone = sd.gym.Env("s_bend", render_mode="rgb_array", image_size=40, cache=cache)
    alone.reset(seed=2)
    frames = many.render()
    assert len(frames) == 2 and np.array_equal(frames[1], alone.render()) and (frames[0] != frames[1]).any()
    assert sd.gym.VectorEnv("s_bend", 2, threads=1, cache=cache).render() is None
    assert alone._repr_png_().startswith(b"\x89PNG")
