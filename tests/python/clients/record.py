"""Writes contracts.json: what stEVE, stEVE_bench and CathSim have, from their own sources and runs.

    python3 record.py --steve FOLDER --steve-bench FOLDER --cathsim FOLDER

Folders are those of the repositories. stEVE is run, with gymnasium from PYTHONPATH, but not its SOFA; CathSim's source is read,
as its MuJoCo is not in Debian. Only names, signatures, shapes, types and numbers of the interfaces are kept, no code, no mesh.
"""

import argparse
import ast
import inspect
import json
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "standins"))


def literal(node):
    try:
        return ast.literal_eval(node)
    except (ValueError, TypeError):
        return None


def keywords(function):
    """Keywords of a function and their defaults, in order."""
    names = [one.arg for one in function.args.args if one.arg != "self"]
    defaults = [literal(one) for one in function.args.defaults]
    return dict(zip(names, [None] * (len(names) - len(defaults)) + defaults))


def find(tree, kind, name):
    return next(node for node in ast.walk(tree) if isinstance(node, kind) and node.name == name)


def cathsim(folder):
    source = folder / "src" / "cathsim"
    env = ast.parse((source / "gym" / "envs" / "cathsim.py").read_text())
    task = ast.parse((source / "dm" / "env.py").read_text())
    register = ast.parse((source / "gym" / "envs" / "__init__.py").read_text())
    call = next(node for node in ast.walk(register) if isinstance(node, ast.Call)
                and getattr(node.func, "id", "") == "register")
    own = find(env, ast.ClassDef, "CathSim")
    info = find(own, ast.FunctionDef, "_get_info")
    observables = find(find(task, ast.ClassDef, "Navigate"), ast.FunctionDef, "_setup_observables")
    entities = keywords(find(find(task, ast.ClassDef, "Navigate"), ast.FunctionDef, "__init__"))
    for name in ("phantom", "guidewire", "tip"):
        del entities[name]
    make = keywords(find(task, ast.FunctionDef, "make_dm_env"))
    wires = {node.func.id: literal(node.keywords[0].value) for node in ast.walk(task) if isinstance(node, ast.Call)
             and getattr(node.func, "id", "") in ("Guidewire", "Tip") and node.keywords}
    properties = [node.name for node in own.body if isinstance(node, ast.FunctionDef) and any(
        getattr(one, "id", "") == "property" for one in node.decorator_list)]
    sites = {}
    for file in sorted((source / "dm" / "components" / "phantom_assets").glob("*.xml")):
        lines = [line for line in file.read_text().splitlines() if "<site " in line]
        sites[file.stem] = [line.split('name="')[1].split('"')[0] for line in lines]
    return {
        "id": literal(next(one.value for one in call.keywords if one.arg == "id")),
        "max_episode_steps": literal(next(one.value for one in call.keywords if one.arg == "max_episode_steps")),
        "keywords": keywords(find(own, ast.FunctionDef, "__init__")), "task_keywords": {**entities, **make},
        "methods": [node.name for node in own.body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
                    and node.name not in properties],
        "render": keywords(find(own, ast.FunctionDef, "render")),
        "render_frame": keywords(find(own, ast.FunctionDef, "render_frame")), "properties": properties,
        "infos": sorted({node.arg for node in ast.walk(info) if isinstance(node, ast.keyword)}
                        | {literal(node.slice) for node in ast.walk(info) if isinstance(node, ast.Subscript)}),
        "observations": sorted({literal(node.slice) for node in ast.walk(observables) if isinstance(node, ast.Subscript)
                                and literal(node.slice)}),
        # slider and rotator, two bends for each body but the wire's first
        "joints": 2 + 2 * (wires["Guidewire"] - 1 + wires["Tip"]),
        "pixels": {"pixels": 3, "side": 1, "guidewire": 1, "phantom": 1}, "phantoms": sites}


def signature(function):
    return [name for name in inspect.signature(function).parameters if name not in ("self", "args", "kwds", "kwargs")]


def space(one):
    return {"shape": list(one.shape), "dtype": str(one.dtype)}


def steve(bench):
    import numpy as np

    import eve
    from eve.intervention import fluoroscopy, simulation, target, vesseltree

    made = {"intervention": eve.intervention.Intervention, "simulated_intervention": eve.intervention.SimulatedIntervention,
            "simulation": simulation.Simulation, "fluoroscopy": fluoroscopy.Fluoroscopy, "vessel_tree": vesseltree.VesselTree,
            "target": target.Target, "device": eve.intervention.device.Device}
    kept = {"classes": {name: {
        "attributes": sorted({key for one in cls.__mro__ for key in getattr(one, "__annotations__", {})}),
        "properties": sorted(key for key, value in inspect.getmembers(cls) if isinstance(value, property)),
        "methods": {key: signature(value) for key, value in inspect.getmembers(cls, inspect.isfunction)
                    if not key.startswith("_") and value.__module__.startswith("eve.intervention")}}
        for name, cls in made.items()}}
    kept["parts"] = {kind: sorted(key for key, value in inspect.getmembers(getattr(eve, kind), inspect.isclass)
                                  if value.__module__.startswith("eve."))
                     for kind in ("observation", "reward", "terminal", "truncation", "info", "pathfinder", "start",
                                  "interimtarget")}
    # stEVE's own dummies, stepped: what its spaces, types and infos are when nothing of ours takes part.
    rng = np.random.default_rng(0)
    tree = vesseltree.AorticArch(seed=30, scaling_xyzd=[1.0, 1.0, 1.0, 0.85])
    tree.reset()
    devices = [eve.intervention.device.JShaped(velocity_limit=(35, 3.14)) for _ in range(2)]
    dummy = simulation.SimulationDummy()
    seen = fluoroscopy.TrackingOnly(dummy, tree, 7.5, [25, 0])
    place = target.CenterlineRandom(tree, seen, 5, ["lcca"])

    class Mono(eve.intervention.MonoPlaneStatic):
        def reset(self, episode_number=0, seed=None, options=None):
            self.simulation.reset(None, None, None, self.devices)
            self.target.reset(episode_number, seed)

    one = Mono(tree, devices, dummy, seen, place)
    one.reset(0, 3)
    o = eve.observation
    finder = eve.pathfinder.BruteForceBFS(one)
    observed = {"tracking": o.wrapper.Memory(o.wrapper.NormalizeTracking2DEpisode(o.Tracking2D(one, 3, 2), one), 2, 0),
                "tracking3d": o.Tracking3D(one, 3, 2), "target": o.Target2D(one), "target3d": o.Target3D(one),
                "lengths": o.InsertionLengths(one), "rotation": o.Rotations(one), "last_action": o.LastAction(one)}
    env = eve.Env(one, o.ObsDict(observed), eve.reward.Combination([eve.reward.Step(-0.005), eve.reward.PathLengthDelta(
        finder, 0.001)]), eve.terminal.TargetReached(one), eve.truncation.MaxSteps(9), eve.info.Combination(
            [eve.info.TargetReached(one, "success"), eve.info.PathRatio(finder), eve.info.Steps(),
             eve.info.TrajectoryLength(one)]), eve.start.StartDummy(), finder)
    env.reset(seed=3)
    observation, reward, terminal, truncation, info = env.step(rng.uniform(-1, 1, (2, 2)))
    kept["env"] = {"action_space": {**space(env.action_space), "high": env.action_space.high.tolist()},
                   "spaces": {key: space(value) for key, value in env.observation_space.spaces.items()},
                   "observations": {key: {"shape": list(value.shape), "dtype": str(value.dtype)}
                                    for key, value in observation.items()},
                   "results": [type(reward).__name__, type(terminal).__name__, type(truncation).__name__],
                   "infos": {key: type(value).__name__ for key, value in info.items()}}
    # An arch that stEVE draws, every third point, and which one a seed gives.
    drawn = vesseltree.AorticArchRandom(scale_diameter_array=[0.85], arch_types_filter=[vesseltree.ArchType.I])
    drawn.reset(0, int(np.random.default_rng(5).integers(0, 2 ** 31)))

    def sparse(values):
        return np.round(np.concatenate([values[:-1:3], values[-1:]]), 2).tolist()

    kept["arch"] = {"seed": 5, "insertion": np.round(drawn.insertion.position, 2).tolist(), "branches": [
        {"name": branch.name, "points": sparse(branch.coordinates), "radii": sparse(branch.radii)}
        for branch in drawn.branches]}
    device = devices[0].sofa_device
    kept["device"] = {key: getattr(device, key) for key in (
        "is_a_procedural_shape", "length", "straight_length", "spire_diameter", "radius", "radius_extremity", "inner_radius",
        "inner_radius_extremity", "young_modulus", "young_modulus_extremity", "poisson_ratio")}
    kept["benchmarks"] = {name: benchmark(bench / "eve_bench" / f"{name.lower()}.py")
                          for name in ("BasicWireNav", "ArchVariety", "DualDeviceNav")}
    return kept


def benchmark(file):
    """Numbers of a benchmark's definition."""
    calls = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Call)]

    def named(name):
        return [{one.arg: literal(one.value) for one in node.keywords if literal(one.value) is not None} for node in calls
                if getattr(node.func, "attr", "") == name]

    return {"devices": named("JShaped"), "fluoroscopy": named("TrackingOnly")[0], "target": named("CenterlineRandom")[0],
            "simulation": named("SofaBeamAdapter")[0]}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for option in ("--steve", "--steve-bench", "--cathsim"):
        parser.add_argument(option, type=Path, required=True)
    given = parser.parse_args()
    import sitecustomize  # noqa: F401: the stand-ins, where they were not imported at the start
    if "standins" not in str(sitecustomize.__file__):
        del sys.modules["sitecustomize"]
        import sitecustomize  # noqa: F401,F811
    sys.path.insert(0, str(given.steve))
    kept = {"cathsim": cathsim(given.cathsim), "steve": steve(given.steve_bench)}
    text = json.dumps(kept, indent=1, sort_keys=True)
    text = re.sub(r"\[([^\[\]{}]+)\]", lambda found: "[" + " ".join(found[1].split()) + "]", text)  # a list in a line
    (HERE / "contracts.json").write_text(text + "\n")
    print(HERE / "contracts.json")
