"""compat.eve and compat.cathsim, against what tests/python/clients/record.py recorded from stEVE and CathSim, and against these
themselves where their folders are named (tests/python/clients/README.md)."""

import ast
import copy
import importlib.util
import inspect
import json
import os
import pickle
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import seldinger as sd
from seldinger.compat import cathsim, steve_scenario

CLIENTS = Path(__file__).resolve().parent / "clients"
RECORDED = json.loads((CLIENTS / "contracts.json").read_text())
STEVE, CATHSIM = RECORDED["steve"], RECORDED["cathsim"]
SOURCE = ast.parse((Path(cathsim.__file__).parent / "eve.py").read_text())


def run(script, *arguments, needs, before=()):
    """Runs a client's script with the folders that the variables of `needs` name."""
    folders = [os.environ.get(name) for name in needs]
    for name, folder in zip(needs, folders):
        if not folder:
            pytest.skip(f"{name} names no folder of sources")
    path = [str(CLIENTS / "standins"), *folders, os.environ.get("PYTHONPATH", "")]
    ended = subprocess.run([sys.executable, *before, CLIENTS / script, *map(str, arguments)], capture_output=True, text=True,
                           env=dict(os.environ, PYTHONPATH=os.pathsep.join(path), PYTHONDONTWRITEBYTECODE="1"))
    assert ended.returncode == 0, (ended.stdout + ended.stderr)[-3000:]
    return ended.stdout


# stEVE

def defined(name):
    """Methods and properties that a class of compat.eve defines, and their parameters."""
    cls = next(node for node in SOURCE.body if isinstance(node, ast.ClassDef) and node.name == name)
    return {node.name: [one.arg for one in node.args.args if one.arg != "self"] for node in cls.body
            if isinstance(node, ast.FunctionDef)}


def test_eve_says_what_is_missing_without_steve():
    if importlib.util.find_spec("eve"):
        pytest.skip("stEVE is installed")
    with pytest.raises(ImportError, match="stEVE cannot be imported: No module named 'eve'.*lkarstensen/stEVE"):
        sd.compat.eve


def test_eve_overrides_methods_of_steve_with_their_parameters():
    recorded = STEVE["classes"]
    simulation = defined("Simulation")
    for name, parameters in recorded["simulation"]["methods"].items():
        if not name.startswith("get_"):
            assert simulation[name] == parameters, name
    assert set(recorded["simulation"]["properties"]) <= set(simulation)
    for ours, theirs in (("_OnSeldinger", "simulated_intervention"), ("VesselTree", "vessel_tree"),
                         ("Fluoroscopy", "fluoroscopy")):
        methods = recorded[theirs]["methods"]
        shared = set(defined(ours)) & set(methods)
        assert all(defined(ours)[name] == methods[name] for name in shared), ours
        assert set(defined(ours)) - {"__init__"} - set(methods) - set(recorded[theirs]["attributes"]) <= {
            "core", "_read", "_seen", "tracking3d_to_2d"}


def test_eve_has_the_devices_of_the_benchmarks():
    def literals(call):
        made = {}
        for one in call.keywords:
            if one.arg is None:  # **common
                assigned = next(node for node in ast.walk(SOURCE) if isinstance(node, ast.Assign)
                                and getattr(node.targets[0], "id", "") == one.value.id)
                made.update(literals(assigned.value))
            else:
                try:
                    made[one.arg] = ast.literal_eval(one.value)
                except ValueError:
                    made[one.arg] = None
        return made

    calls = [literals(node) for node in ast.walk(SOURCE) if isinstance(node, ast.Call)
             and getattr(node.func, "attr", "") == "JShaped"]
    ours = {call["name"]: call for call in calls}
    shown = {"name", "color", "visu_edges_per_mm", "collis_edges_per_mm_tip", "collis_edges_per_mm_straight",
             "beams_per_mm_tip", "mass_density_tip", "mass_density_straight"}  # of SOFA and its window
    for benchmark in STEVE["benchmarks"].values():
        for theirs in benchmark["devices"]:
            mine = ours[theirs["name"]]
            for key in set(theirs) - shown:
                default = 0 if "inner" in key else None
                value = mine.get(key, default)
                assert value is None and key not in mine or np.allclose(value, theirs[key]), key
    assert len(ours) == 3


def shape(**changes):
    return types.SimpleNamespace(**{**STEVE["device"], **changes})


def arch():
    return [types.SimpleNamespace(name=one["name"], coordinates=np.array(one["points"]), radii=np.array(one["radii"]))
            for one in STEVE["arch"]["branches"]]


def test_an_arch_that_steve_draws_holds_its_wire(cache):
    branches = arch()
    scenario = steve_scenario.in_branches(branches, STEVE["arch"]["insertion"], [shape()], 0.1)
    points, radii = np.concatenate([one.coordinates for one in branches]), np.concatenate([one.radii for one in branches])
    with sd.Simulation(scenario, cache=cache) as sim:
        about = sim.about()
        assert about["device_lengths_mm"] == [450] and about["device_diameters_mm"] == [pytest.approx(0.89)]
        assert len(sim.anatomy()["branches"]) == len(branches) - 1  # the trunk goes on as one of its two branches
        rng = np.random.default_rng(2)
        for _ in range(120):
            state = sim.step(rng.uniform(-1, 4), rng.uniform(-20, 20))
            away = np.linalg.norm(state.wire_mm[:, None] - points, axis=2) - radii
            assert away.min(1).max() < 1.0
        assert state.inserted_mm > 150


def test_devices_of_steve_have_their_stiffness_and_bend():
    made = steve_scenario.device(shape(), 0.1, "wire")
    assert made["shaft_rigidity_N_mm2"] == pytest.approx(100 * 80 * np.pi / 64 * 0.89 ** 4)
    assert made["tip_rigidity_N_mm2"] / made["shaft_rigidity_N_mm2"] == pytest.approx(17 / 80 * (0.7 / 0.89) ** 4)
    assert made["curved_angle_deg"] == pytest.approx(72) and made["curved_length_mm"] == pytest.approx(12.1 * 0.4 * np.pi)
    straight = steve_scenario.device(shape(spire_diameter=0.0), 0.1, "wire")
    assert straight["curved_angle_deg"] == 0 and straight["tip_length_mm"] > 0
    solid = steve_scenario.device(shape(inner_radius=0.445), 0.1, "wire")
    assert solid["shaft_rigidity_N_mm2"] == made["shaft_rigidity_N_mm2"]


def test_vessels_of_steve_that_cannot_be_taken_are_named():
    branches = arch()
    branches[2].coordinates = branches[2].coordinates + [0, 80, 0]
    with pytest.raises(sd.InputError, match="outside all others; expected branches that touch"):
        steve_scenario.vessels(branches, STEVE["arch"]["insertion"], 1.0)
    branches = arch()
    del branches[1].radii
    with pytest.raises(sd.InputError, match="branch 'bct' has no radii"):
        steve_scenario.vessels(branches, STEVE["arch"]["insertion"], 1.0)
    with pytest.raises(sd.InputError, match="devices: 5 were given"):
        steve_scenario.in_arch([shape()] * 5, 0.1, [0, 0])


@pytest.mark.parametrize("benchmark", ["BasicWireNav", "ArchVariety", "DualDeviceNav"])
def test_every_part_of_the_real_steve_runs_over_ours(cache, benchmark):
    out = run("steve_parts.py", benchmark, cache, needs=("SELDINGER_STEVE", "SELDINGER_GYMNASIUM"))
    assert "as recorded" in out


def test_the_real_steve_gives_the_same_vessels_and_targets(cache):
    out = run("steve_same.py", cache, needs=("SELDINGER_STEVE", "SELDINGER_GYMNASIUM"))
    assert "the same" in out


# CathSim

def small(cache, **arguments):
    return cathsim.CathSim("bifurcation", cache=cache, image_size=40, **{"target": [0.05, 0, 0], **arguments})


def test_cathsim_has_the_recorded_keywords_methods_and_sites(cache):
    parameters = inspect.signature(cathsim.CathSim).parameters
    for name, default in {**CATHSIM["task_keywords"], **CATHSIM["keywords"]}.items():
        assert parameters[name].default == default, name
    assert list(parameters)[:len(CATHSIM["keywords"])] == [name for name in (
        "phantom", "use_contact_forces", "use_force", "use_geom_pos", "return_info", "dm_env") if name in CATHSIM["keywords"]]
    for name in CATHSIM["methods"]:
        assert callable(getattr(cathsim.CathSim, name))
    for name in ("render", "render_frame"):
        ours = inspect.signature(getattr(cathsim.CathSim, name)).parameters
        assert {key: ours[key].default for key in CATHSIM[name]} == CATHSIM[name]
    missing = [name for name in CATHSIM["properties"] if not isinstance(getattr(cathsim.CathSim, name, None), property)]
    assert missing == ["physics"]
    assert set(cathsim.PHANTOMS) == set(CATHSIM["phantoms"])
    assert all(set(sites) == set(cathsim.TARGETS) for sites in CATHSIM["phantoms"].values())
    assert (cathsim.ID, cathsim.MOST_STEPS) == (CATHSIM["id"], CATHSIM["max_episode_steps"])


def test_cathsim_has_the_recorded_observations_and_infos(cache):
    env = cathsim.CathSim(use_pixels=True, use_side=True, use_segment=True, use_phantom_segment=True, return_info=True,
                          use_contact_forces=True, use_force=True, use_geom_pos=True, cache=cache)
    observation, info = env.reset(seed=1)
    assert set(observation) == set(CATHSIM["observations"]) == set(env.observation_space.spaces) and info == {}
    for key, channels in CATHSIM["pixels"].items():
        assert observation[key].shape == (80, 80, channels) and observation[key].dtype == np.uint8
        assert observation[key].max() > 0
    for key in ("joint_pos", "joint_vel"):
        assert observation[key].shape == (CATHSIM["joints"],) and observation[key].dtype == np.float32
    assert env.observation_space.contains(observation)
    assert env.action_space.shape == (2,) and env.action_space.low.tolist() == [-1, -1]
    first = observation["joint_pos"]
    # 0.14 m to the target, as in CathSim
    assert np.linalg.norm(env.head_pos - env.target) == pytest.approx(0.14, abs=0.01)
    for _ in range(30):
        observation, reward, terminated, truncated, info = env.step([1.0, 0.5])
        assert set(info) == set(CATHSIM["infos"]) and not truncated
        assert reward == pytest.approx(-np.linalg.norm(info["head_pos"] - info["target_pos"])) and not terminated
    assert observation["joint_pos"][0] == pytest.approx(30 * 0.035 / 15, rel=1e-4)  # fed [m]
    assert observation["joint_pos"][1] == pytest.approx(30 * 0.5 * 3.14 / 15, rel=1e-4)
    assert observation["joint_vel"][0] == pytest.approx(0.035, rel=1e-3)
    assert (observation["joint_pos"][2:] != first[2:]).any() and np.abs(observation["joint_pos"][2:]).max() < 0.5
    assert info["geom_pos"].shape == (84, 3)
    np.testing.assert_allclose(info["geom_pos"][-1], info["head_pos"])
    np.testing.assert_allclose(np.linalg.norm(np.diff(info["geom_pos"], axis=0), axis=1), 0.002, rtol=0.05)
    for _ in range(60):
        info = env.step([1.0, 0.0])[4]
    contacts = info["contact_forces"]
    assert len(contacts["pos"]) == len(contacts["force"]) > 0 and min(contacts["force"]) > 0.001
    assert info["forces"] >= sum(contacts["force"]) > 0.5 * info["forces"]
    assert env.render(image_size=64).shape == env.render_frame(64, camera_id=2).shape == (64, 64, 3)
    env.set_target("lcca")
    np.testing.assert_array_equal(env.target, env.sites["lcca"])
    env.close()
    for call in (lambda: env.step([0, 0]), lambda: env.reset(seed=0), env.render):
        with pytest.raises(sd.InputError, match="closed"):
            call()


def test_bends_of_cathsim_are_those_of_the_wire(cache):
    env = small(cache)
    env.reset(seed=0)
    points = 1e3 * env.guidewire_geom_pos
    ways = np.diff(points, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    angles = np.arccos(np.clip((ways[1:] * ways[:-1]).sum(1), -1, 1))
    bends = env.step([0, 0])[0]["joint_pos"][2:].reshape(-1, 2)
    env.reset(seed=0)
    bends = env._joints[2:].reshape(-1, 2)
    np.testing.assert_allclose(np.linalg.norm(bends, axis=1)[1:], angles, atol=0.02)


def test_cathsim_rewards_and_ends_at_the_target(cache):
    env = small(cache, success_reward=7.0, delta=0.02)
    env.reset(seed=0)
    env.set_target(env.head_pos)
    assert env.step([0, 0])[1:4] == (7.0, True, False)
    env = small(cache, dense_reward=False)
    env.reset(seed=0)
    assert env.step([0, 0])[1:] == (-1.0, False, False, {})


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["deepcopy", "pickle"])
@pytest.mark.parametrize("arguments", [{"dense_reward": False}, {"dense_reward": True, "use_pixels": True, "use_side": True}])
def test_copies_of_cathsim_go_on_as_it_does(cache, copied, arguments):
    env = small(cache, return_info=True, **arguments)
    env.reset(seed=3)
    env.step([1, 0.5])
    other = copied(env)
    for _ in range(2):
        for step in ([1, -0.2], [0.5, 0]):
            mine, theirs = env.step(step), other.step(step)
            assert mine[1:4] == theirs[1:4]
            for ours, copies in ((mine[0], theirs[0]), (mine[4], theirs[4])):
                assert ours.keys() == copies.keys()
                assert all(np.array_equal(value, copies[key]) for key, value in ours.items())
        env.reset()
        other.reset()


def test_seeds_of_cathsim_have_an_effect(cache):
    env = cathsim.CathSim(sample_target=True, target_from_sites=False, cache=cache)
    begun = []
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        begun.append((env.target.copy(), env.head_pos.copy()))
    assert (begun[0][0] != begun[1][0]).any() and (begun[0][1] != begun[1][1]).any()
    np.testing.assert_array_equal(begun[0], begun[2])


@pytest.mark.parametrize("arguments, says", [
    ({"dm_env": 1}, "dm_env"), ({"apply_fluid_force": True}, "apply_fluid_force"), ({"image_size": 8}, "32 to 2048"),
    ({"target": "nowhere"}, "target: 'nowhere'"), ({"target": [1, 2]}, "three numbers"), ({"delta": "x"}, "delta"),
    ({"success_reward": np.nan}, "success_reward"), ({"render_mode": "human"}, "render_mode"),
    ({"phantom": "renal_cobra", "target": [0, 0, 0]}, "a wire alone"), ({"phantom": "phantom9"}, "no such scenario")])
def test_cathsim_names_arguments_that_are_not_accepted(cache, arguments, says):
    with pytest.raises(sd.InputError, match=says):
        cathsim.CathSim(**{"phantom": "bifurcation", "target": [0, 0, 0], "cache": cache, **arguments})


def test_cathsim_names_actions_that_are_not_accepted(cache):
    env = small(cache)
    env.reset(seed=0)
    for action in ([np.nan, 0], "x", None, [0, 0, 0], [[0, 0]]):
        with pytest.raises(sd.InputError, match="two finite numbers"):
            env.step(action)


def test_cathsim_as_a_program_asks_for_a_script():
    ended = subprocess.run([sys.executable, "-m", "seldinger.compat.cathsim"], capture_output=True, text=True)
    assert ended.returncode == 1 and "no script was given; expected one, and its arguments" in ended.stderr


def test_cathsim_takes_the_place_of_cathsim_for_scripts_and_their_processes(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("""
import multiprocessing, sys

def who(_=None):
    return sys.modules["cathsim.gym.envs"].CathSim.__module__

if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        print(who(), *pool.map(who, [0]), *sys.argv[1:])
""")
    ended = subprocess.run([sys.executable, "-m", "seldinger.compat.cathsim", script, "--option"], capture_output=True,
                           text=True)
    assert ended.stdout.split() == ["seldinger.compat.cathsim"] * 2 + ["--option"], ended.stderr


def test_the_real_wrappers_and_metrics_of_cathsim_run_over_ours(cache):
    out = run("cathsim_parts.py", cache, needs=("SELDINGER_CATHSIM", "SELDINGER_GYMNASIUM_0_29", "SELDINGER_SB3"),
              before=("-m", "seldinger.compat.cathsim"))
    assert "all ran" in out


# Stable-Baselines3, over seldinger.gym

def test_the_real_stable_baselines_learns(cache):
    assert "learnt" in run("sb3_learn.py", cache, needs=("SELDINGER_SB3", "SELDINGER_GYMNASIUM"))
