"""steve_parts.py BENCHMARK CACHE: every observation, reward, terminal, truncation, info, pathfinder, start and interim target
of the installed stEVE over a benchmark of compat.eve, in stEVE's own Env. Prints what ran; fails where others than KNOWN do."""

import copy
import inspect
import json
import os
import pickle
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

warnings.simplefilter("ignore")

import eve  # noqa: E402
import seldinger.compat.eve as ours  # noqa: E402
from eve import info as I, interimtarget as M, observation as O, pathfinder as P, reward as R  # noqa: E402
from eve import start as S, terminal as T, truncation as C  # noqa: E402
from eve.intervention import target as G  # noqa: E402
from eve.observation import wrapper as W  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

RECORDED = json.loads((Path(__file__).resolve().parent / "contracts.json").read_text())["steve"]

# What no intervention can run, because of faults in stEVE itself (commit f909e712 of December 2024).
KNOWN = {
    "observation InsertionLengthRelative": "calls object.__init__ with a name", "observation RelativeToLastState": "the same",
    "observation SelectiveMemory": "the same", "observation ShowVessels": "asks for methods that no Fluoroscopy has",
    "info AverageSteps": "the mean of None at a reset", "info AverageEpisodesLastStep": "the same",
    "interimtarget Branching": "pops from an array, where the way has a branching point",
    "target Manual": "has no coordinates2d", "target TargetDummy": "has no coordinates"}
ABSTRACT = {"Observation", "Reward", "Terminal", "Truncation", "Info", "Pathfinder", "Start", "InterimTarget"}


def env_of(intervention, finder, **parts):
    made = dict(observation=O.Tracking2D(intervention), reward=R.Step(1.0), terminal=T.TargetReached(intervention),
                truncation=C.MaxSteps(200), pathfinder=finder)
    return eve.Env(intervention, **{**made, **parts})


def play(env, episodes=2, steps=4):
    for episode in range(episodes):
        env.reset(seed=episode)
        for _ in range(steps):
            result = env.step(env.action_space.high * np.array([1, 0.5], np.float32))
    return result


def parts_of(i, finder, even):
    n, tracking = len(i.devices), O.Tracking2D
    lengths = lambda: O.InsertionLengths(i)  # noqa: E731
    return {
        "observation": {
            "Tracking2D": lambda: O.Tracking2D(i, 4, 2.0), "Tracking3D": lambda: O.Tracking3D(i, 4, 2.0),
            "TrackingDevice2D": lambda: O.TrackingDevice2D(i, n - 1, 3, 2.0), "Target2D": lambda: O.Target2D(i),
            "Target3D": lambda: O.Target3D(i), "InsertionLengths": lengths, "Rotations": lambda: O.Rotations(i),
            "LastAction": lambda: O.LastAction(i), "Image": lambda: O.Image(i),
            "InsertionLengthRelative": lambda: O.InsertionLengthRelative(i, 0, n - 1),
            "ObsDict": lambda: O.ObsDict({"a": tracking(i), "b": O.Target2D(i)}),
            "ObsTuple": lambda: O.ObsTuple([tracking(i), O.Target2D(i)]), "Normalize": lambda: W.Normalize(lengths()),
            "NormalizeCustom": lambda: W.NormalizeCustom(lengths(), [0] * n, [900] * n),
            "NormalizeTracking2DEpisode": lambda: W.NormalizeTracking2DEpisode(tracking(i, 3, 2), i),
            "Memory": lambda: W.Memory(tracking(i, 3, 2), 2, W.MemoryResetMode.ZERO),
            "RelativeToFirstRow": lambda: W.RelativeToFirstRow(tracking(i, 3, 2)),
            "RelativeToLastState": lambda: W.RelativeToLastState(tracking(i, 3, 2)),
            "SelectiveMemory": lambda: W.SelectiveMemory(tracking(i, 3, 2), [0, 2], W.MemoryResetMode.FILL),
            "ShowVessels": lambda: O.imagewrapper.ShowVessels(i, O.Image(i))},
        "reward": {
            "TargetReached": lambda: R.TargetReached(i, 1.0, even, False), "PathLength": lambda: R.PathLength(finder, 1.0),
            "PathLengthDelta": lambda: R.PathLengthDelta(finder, 1.0), "Step": lambda: R.Step(-0.005),
            "TipToTargetDistDelta": lambda: R.TipToTargetDistDelta(1.0, i, even), "LastAction": lambda: R.LastAction(i, 0, 1.0),
            "InsertionLengthRelative": lambda: R.InsertionLengthRelative(i, 0, n - 1, 1.0, -1, 1),
            "InsertionLengthRelativeDelta": lambda: R.InsertionLengthRelativeDelta(i, 0, n - 1, 1.0, -1, 1),
            "Combination": lambda: R.Combination([R.Step(-1.0), R.TargetReached(i, 1.0)])},
        "terminal": {"TargetReached": lambda: T.TargetReached(i), "Combination": lambda: T.Combination([T.TargetReached(i)])},
        "truncation": {
            "MaxSteps": lambda: C.MaxSteps(3), "VesselEnd": lambda: C.VesselEnd(i), "SimError": lambda: C.SimError(i),
            "Dummy": lambda: C.TruncationDummy(), "Combination": lambda: C.Combination([C.MaxSteps(3), C.SimError(i)])},
        "info": {
            "TargetReached": lambda: I.TargetReached(i), "PathRatio": lambda: I.PathRatio(finder), "Steps": lambda: I.Steps(),
            "AverageTranslationSpeed": lambda: I.AverageTranslationSpeed(i), "TrajectoryLength": lambda: I.TrajectoryLength(i),
            "RewardInfo": lambda: I.RewardInfo(R.Step(1.0)), "TerminalInfo": lambda: I.TerminalInfo(T.TargetReached(i)),
            "Dummy": lambda: I.InfoDummy(), "Combination": lambda: I.Combination([I.Steps(), I.PathRatio(finder)]),
            "AverageSteps": lambda: I.wrapper.AverageSteps(I.Steps(), 3),
            "AverageEpisodesLastStep": lambda: I.wrapper.AverageEpisodesLastStep(I.Steps(), 3)},
        "start": {
            "InsertionPoint": lambda: S.InsertionPoint(i), "MaxDeviceLength": lambda: S.MaxDeviceLength(i, 50),
            "VesselEnd": lambda: S.VesselEnd(i), "StartDummy": lambda: S.StartDummy(),
            "RandomAdvance": lambda: S.RandomAdvance(i, 1.0, [[0, -1]] * n, [[30, 1]] * n)},
        "pathfinder": {"BruteForceBFS": lambda: P.BruteForceBFS(i), "Dummy": lambda: P.PathfinderDummy()},
        "interim_target": {"Even": lambda: M.Even(finder, i, 10.0, 5.0), "Branching": lambda: M.Branching(finder, i, 10.0, 5.0),
                           "Dummy": lambda: M.InterimTargetDummy()}}


def main(benchmark, cache):
    intervention = getattr(ours, benchmark)(cache=cache)
    assert isinstance(intervention, eve.intervention.Intervention)
    intervention.reset(0, seed=1)
    finder = P.BruteForceBFS(intervention)
    failed, tried = {}, {}

    def attempt(kind, name, call):
        tried.setdefault(kind, set()).add(name)
        try:
            call()
            print("ran   ", kind, name)
        except Exception as error:  # whatever it is, it is reported
            failed[f"{kind} {name}"] = f"{type(error).__name__}: {error}"[:120]
            print("failed", kind, name, failed[f"{kind} {name}"])

    even = M.Even(finder, intervention, 10.0, 5.0)
    for kind, parts in parts_of(intervention, finder, even).items():
        for name, make in parts.items():
            def one():
                part = make()
                more = {"reward": {"interim_target": even},
                        "interim_target": {"observation": O.Target2D(intervention, part)}}.get(kind, {})
                play(env_of(intervention, finder, **{kind: part}, **more))
            attempt(kind.replace("_", ""), name, one)
    # None was forgotten.
    for kind, names in RECORDED["parts"].items():
        now = {cls.__name__ for _, cls in inspect.getmembers(getattr(eve, kind), inspect.isclass)
               if cls.__module__.startswith("eve." + kind)}
        assert now - ABSTRACT <= tried[kind], (kind, now - ABSTRACT - tried[kind])

    kept, tree = intervention.target, intervention.vessel_tree
    branch = tree.branches[1]
    seen = intervention.fluoroscopy
    for name, make in {"CenterlineRandom": lambda: G.CenterlineRandom(tree, seen, 5, [branch.name]),
                       "BranchEnd": lambda: G.BranchEnd(tree, seen, 5, [branch.name]),
                       "BranchIndex": lambda: G.BranchIndex(tree, seen, 5, branch.name, 3),
                       "Manual": lambda: G.Manual([branch.coordinates[3]], 5, seen),
                       "TargetDummy": lambda: G.TargetDummy(seen, 5)}.items():
        def one():
            intervention.target = make()
            play(env_of(intervention, P.BruteForceBFS(intervention), observation=O.Target2D(intervention)))
        attempt("target", name, one)
        intervention.target = kept

    def config(only):
        env = env_of(intervention, finder)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "env.yml")
            env.save_config(file, only)
            again = eve.Env.from_config_file(file)
        assert type(again.intervention) is type(intervention)
        for one in (env, again):
            play(one, 1)
        np.testing.assert_array_equal(env.observation(), again.observation())

    attempt("config", "stEVE's classes only", lambda: config(True))
    attempt("config", "all classes", lambda: config(False))
    attempt("states", "of a recorder", lambda: (intervention.get_reset_state(), intervention.get_step_state()))
    for name, copied in (("deepcopy", copy.deepcopy), ("pickle", lambda one: pickle.loads(pickle.dumps(one)))):
        def one():
            twin = copied(intervention)
            for each in (intervention, twin):
                each.reset(0, seed=4)
                each.reset_devices()
                each.step(each.action_space.high)
            np.testing.assert_array_equal(intervention.simulation.dof_positions, twin.simulation.dof_positions)
            np.testing.assert_array_equal(intervention.target.coordinates3d, twin.target.coordinates3d)
        attempt("copy", name, one)
    attempt("gymnasium", "check_env", lambda: check_env(env_of(intervention, finder, observation=O.ObsDict(
        {"a": O.Tracking2D(intervention), "b": O.Target2D(intervention)})), skip_render_check=True))
    strange = {name: error for name, error in failed.items() if name not in KNOWN}
    assert not strange, strange

    # Spaces, types and infos are those recorded of stEVE over its own dummies, for as many devices.
    i, n = intervention, len(intervention.devices)
    observed = {"tracking": W.Memory(W.NormalizeTracking2DEpisode(O.Tracking2D(i, 3, 2), i), 2, 0),
                "tracking3d": O.Tracking3D(i, 3, 2), "target": O.Target2D(i), "target3d": O.Target3D(i),
                "lengths": O.InsertionLengths(i), "rotation": O.Rotations(i), "last_action": O.LastAction(i)}
    env = env_of(i, finder, observation=O.ObsDict(observed), reward=R.Combination([R.Step(-0.005), R.PathLengthDelta(
        finder, 0.001)]), info=I.Combination([I.TargetReached(i, "success"), I.PathRatio(finder), I.Steps(),
                                              I.TrajectoryLength(i)]))
    observation, reward, terminal, truncation, info = play(env, 1, 1)
    wanted = RECORDED["env"]
    per_device = {"lengths", "rotation", "last_action"}
    for key, one in wanted["spaces"].items():
        shape = [n, *one["shape"][1:]] if key in per_device else one["shape"]
        assert list(env.observation_space[key].shape) == shape == list(observation[key].shape), key
        assert str(env.observation_space[key].dtype) == one["dtype"], key
        assert str(observation[key].dtype) == wanted["observations"][key]["dtype"], key
    assert env.action_space.high.tolist() == wanted["action_space"]["high"][:n]
    assert [type(one).__name__ for one in (reward, terminal, truncation)] == wanted["results"]
    assert {key: type(value).__name__ for key, value in info.items()} == wanted["infos"]
    numbers = RECORDED["benchmarks"][benchmark]
    assert i.target.threshold == numbers["target"]["threshold"]
    assert i.fluoroscopy.image_frequency == numbers["fluoroscopy"]["image_frequency"]
    assert list(i.fluoroscopy.image_rot_zx) == numbers["fluoroscopy"]["image_rot_zx"]
    for device, theirs in zip(i.devices, numbers["devices"]):
        for key, value in theirs.items():
            if not key.startswith(("color", "collis", "visu", "beams")):
                assert np.allclose(getattr(device, key), value) if not isinstance(value, str) else device.name == value, key
    print("spaces, types, infos and benchmark as recorded;", sum(map(len, tried.values())), "tried,", len(failed),
          "known faults of stEVE")


if __name__ == "__main__":
    main(*sys.argv[1:])
