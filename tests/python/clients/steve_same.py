"""steve_same.py CACHE: the same seed draws the same arch and target as stEVE's classes do; over() keeps the parts of an
intervention of stEVE; seeds, limits and closing."""

import random
import sys
import warnings

import numpy as np

warnings.simplefilter("ignore")

import eve  # noqa: E402
import seldinger as sd  # noqa: E402
import seldinger.compat.eve as ours  # noqa: E402
from eve.intervention import vesseltree  # noqa: E402
from eve.util.coordtransform import vessel_cs_to_tracking3d  # noqa: E402


def arches(cache):
    intervention = ours.ArchVariety(cache=cache)
    for seed in (1, 2, 3):
        intervention.reset(0, seed=seed)
        draws = np.random.default_rng(seed)
        tree = vesseltree.AorticArchRandom(scale_diameter_array=[0.85], arch_types_filter=[vesseltree.ArchType.I])
        tree.reset(0, int(draws.integers(0, 2 ** 31)))
        for mine, theirs in zip(intervention.vessel_tree.branches, tree.branches):
            assert mine.name == theirs.name and np.array_equal(mine.coordinates, theirs.coordinates)
        names = sorted({"lcca", "rcca", "lsa", "rsa", "bct", "co"} & set(tree.keys()))
        places = np.vstack([tree[name].coordinates for name in names])
        inside = tree["aorta"].in_branch(places)
        place = random.Random(int(draws.integers(0, 2 ** 31))).choice(places[~inside])
        np.testing.assert_allclose(intervention.target.coordinates3d, vessel_cs_to_tracking3d(place, [25, 0], [0, 0, 0], None),
                                   rtol=1e-6)
        points = np.concatenate([one.coordinates for one in tree.branches])
        radii = np.concatenate([one.radii for one in tree.branches])
        rng = np.random.default_rng(seed)
        for _ in range(60):
            intervention.step(rng.uniform([-10, -3], [35, 3]))
            away = np.linalg.norm(intervention.simulation.dof_positions[:, None] - points, axis=2) - radii
            assert away.min(1).max() < 1.0, "the wire has left the lumen"
    intervention.close()
    for call in (lambda: intervention.step([[0, 0]]), lambda: intervention.reset(1)):
        try:
            call()
            raise AssertionError("a closed intervention went on")
        except sd.InputError as error:
            assert "closed" in str(error)


def taken_over(cache):
    tree = vesseltree.AorticArch(seed=30, scaling_xyzd=[1.0, 1.0, 1.0, 0.75])
    device = eve.intervention.device.JShaped()
    simulation = eve.intervention.simulation.SofaBeamAdapter(friction=0.001)
    seen = eve.intervention.fluoroscopy.TrackingOnly(simulation, tree, 7.5, [20, 5])
    target = eve.intervention.target.CenterlineRandom(tree, seen, 5, ["lcca", "rcca", "lsa", "rsa", "bct", "co"])
    theirs = eve.intervention.MonoPlaneStatic(tree, [device], simulation, seen, target)
    mine = ours.over(theirs, cache)
    env = eve.Env(mine, eve.observation.Tracking2D(mine, 5), eve.reward.Step(-0.005), eve.terminal.TargetReached(mine),
                  eve.truncation.MaxSteps(200))
    first = env.reset(seed=3)[0]
    before = mine.device_lengths_inserted[0]
    env.step([[30.0, 0.0]])
    assert abs(mine.device_lengths_inserted[0] - before - 30 / 7.5) < 1e-6
    np.testing.assert_array_equal(env.reset(seed=3)[0], first)  # with the wire's first turn
    assert (env.reset(seed=4)[0] != first).any()
    for _ in range(3):  # not drawn out
        env.step([[-50.0, 0.0]])
    assert mine.device_lengths_inserted[0] > 0
    # The view of tracking is that of the image.
    one = ours.Intervention("renal", image_rot_zx=[30, 0], cache=cache)
    one.reset(0, seed=1)
    one.simulation.core.apply("arm lao 30 deg")
    joints = one.simulation.core.state.wire_mm
    flat, pixels = one.fluoroscopy.tracking2d[::-1], one.simulation.core.project(joints, 512)
    for axis, sign in ((0, 1), (1, -1)):
        assert np.corrcoef(flat[:, axis], sign * pixels[:, axis])[0, 1] > 0.99
    quick = ours.Intervention("renal", normalize_action=True, velocity_limit=(20, 1), cache=cache)
    quick.reset(0, seed=1)
    before = quick.device_lengths_inserted[0]
    quick.step([[1.0, 0.0]])
    assert abs(quick.device_lengths_inserted[0] - before - 20 / 7.5) < 1e-6 and quick.action_space.high.tolist() == [[1, 1]]


def refused(cache):
    for arguments, says in (
            ({"velocity_limit": (1, 2, 3)}, "velocity_limit"), ({"velocity_limit": (0, 1)}, "velocity_limit"),
            ({"velocity_limit": "fast"}, "velocity_limit"), ({"image_frequency": 0}, "0.001 to 1000"),
            ({"target_threshold": "x"}, "target_threshold"), ({"target_branches": ["nowhere"]}, "nowhere"),
            ({"image_size": 8}, "32 to 2048"), ({"anatomy_seed": (2, 1)}, "anatomy_seed")):
        try:
            ours.Intervention("renal", cache=cache, **arguments)
            raise AssertionError(f"{arguments} was accepted")
        except sd.InputError as error:
            assert says in str(error), error
    seeds = ours.Intervention("renal", anatomy_seed=(1, 3), cache=cache)
    lengths = set()
    for episode in range(6):
        seeds.reset(episode, seed=episode)
        seeds.reset_devices()
        seeds.step([[10.0, 0.0]])
        lengths.add(round(float(seeds.vessel_tree.branches[0].length), 3))
    assert len(lengths) == 2


if __name__ == "__main__":
    for part in (arches, taken_over, refused):
        part(sys.argv[1])
    print("the same vessels and targets as in stEVE")
