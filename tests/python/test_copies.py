"""Copies of what the module makes: snapshots, states, simulations and environments by copy, deepcopy and pickle go on as
what they were made of, to the bit."""

import copy
import copyreg
import os
import pickle
import random
import subprocess
import sys

import numpy as np
import pytest

import seldinger as sd

SEED = int(os.environ.get("SELDINGER_TEST_SEED", random.randrange(10 ** 6)))
COPIES = {"deepcopy": copy.deepcopy, "copy": copy.copy, "pickle": lambda thing: pickle.loads(pickle.dumps(thing))}


def same(a, b):
    if isinstance(a, np.ndarray) and a.dtype.names:
        return a.dtype == b.dtype and all(same(a[name], b[name]) for name in a.dtype.names)
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return a == b or (a != a and b != b)


def assert_same_state(a, b):
    a, b = a.asdict(), b.asdict()
    assert a.keys() == b.keys() and all(same(value, b[key]) for key, value in a.items())


def acts(sim, rng):
    """Something that a program may do to a simulation."""
    what = rng.integers(8)
    if what == 0:
        sim.apply(f"arm lao {rng.uniform(-90, 90)} deg cranial {rng.uniform(-40, 40)} deg")
    elif what == 1:
        sim.apply(f"table {rng.uniform(-50, 50)} {rng.uniform(-50, 50)} {rng.uniform(-50, 50)} mm")
    elif what == 2:
        sim.apply(rng.choice(["beam on", "beam off", "breath hold", "breath free", "collimate 120.5 90.25 mm",
                              "grip wire 30.125 mm", "mode dsa", "reference"]))
    elif what == 3:
        sim.reset()
    else:
        sim.step(rng.uniform(-3, 5), rng.uniform(-60, 60), frames=int(rng.integers(1, 4)))


@pytest.mark.parametrize("name", ["s_bend", "renal_cobra", "coronary"])
def test_states_snapshots_and_simulations_are_copied_at_any_moment(cache, name, tmp_path):
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    with sd.Simulation(name, images="dose", panel=True, cache=cache) as sim:
        for k in range(4 if name == "coronary" else 12):
            for _ in range(int(rng.integers(1, 5))):
                acts(sim, rng)
            for how in ("deepcopy", "pickle"):
                assert_same_state(COPIES[how](sim.state), sim.state)
            kept = [COPIES["pickle"](sim.snapshot()), copy.deepcopy(sim.snapshot())]
            twins = [copy.deepcopy(sim)] + ([COPIES["pickle"](sim)] if k % 6 == 0 else [])
            motion = dict(advance_mm=rng.uniform(-2, 4), rotate_deg=rng.uniform(-40, 40))
            after = sim.step(**motion)
            sim.save(tmp_path / "mine.gw")
            panel = sim.panel(640, 512)
            for twin in twins:
                assert_same_state(twin.step(**motion), after)
                twin.save(tmp_path / "twin.gw")
                assert (tmp_path / "twin.gw").read_bytes() == (tmp_path / "mine.gw").read_bytes()
                assert twin.score() == sim.score() and np.array_equal(twin.panel(640, 512), panel)
            for snapshot in kept:
                sim.restore(snapshot)
                assert_same_state(sim.step(**motion), after)
                sim.save(tmp_path / "twin.gw")
                assert (tmp_path / "twin.gw").read_bytes() == (tmp_path / "mine.gw").read_bytes()


@pytest.mark.parametrize("how", COPIES)
def test_many_simulations_are_copied_with_what_each_aims_at(bend, cobra, how):
    with sd.VectorSimulation([bend, cobra, bend], threads=2, points=2, spacing_mm=1.5) as many:
        many.step(np.full((3, 1, 2), 0.7))
        many.aim(0, [50, 0, 0], 4)
        many.step(np.full((3, 1, 2), 0.7))
        many.apply(1, "arm lao 12.345678901 deg")
        many.apply(2, "table 0 0 20 mm")
        twin = COPIES[how](many)
        for _ in range(3):
            assert (many.hashes(asked=True) == twin.hashes(asked=True)).all()
            for key, array in many._arrays.items():
                assert same(array, twin._arrays[key]), key
            for each in (many, twin):
                each.step(np.full((3, 1, 2), 0.4))
        assert twin.likes[0] is twin.likes[2] and "of 3 on 2 threads" in repr(twin)


def test_a_copy_of_a_simulation_aims_at_what_it_aimed_at_and_is_closed_alone(renal):
    renal.reset(target="RRA", radius_mm=4)
    for copied in COPIES.values():
        twin = copied(renal)
        assert twin.state.target_radius_mm == 4 and (twin.state.target_mm == renal.state.target_mm).all()
        assert twin.reset().hash == renal.reset().hash and (twin.state.target_mm == renal.state.target_mm).all()
        twin.close()
        assert twin.closed and not renal.closed and "closed" in repr(twin)
        with pytest.raises(sd.InputError, match="closed"):
            copied(twin)


def test_a_simulation_with_a_screen_is_copied_too(cache):
    with sd.Simulation("s_bend", images=True, cache=cache) as sim:
        sim.apply("beam on")
        sim.step(2)
        twin = copy.deepcopy(sim)
        assert np.array_equal(twin.image(mode="screen"), sim.image(mode="screen"))
        assert twin.step(1).hash == sim.step(1).hash


def test_a_pickle_goes_on_in_another_process(bend, tmp_path):
    bend.step(2, 10)
    (tmp_path / "sim.pickle").write_bytes(pickle.dumps((bend, bend.state, bend.snapshot())))
    text = "import pickle, sys; s, state, kept = pickle.load(open(sys.argv[1], 'rb')); " \
           "print(state.hash, s.step(1).hash, s.restore(kept).hash)"
    printed = subprocess.run([sys.executable, "-c", text, tmp_path / "sim.pickle"], capture_output=True, text=True, check=True)
    first = bend.state.hash
    assert [int(hash) for hash in printed.stdout.split()] == [first, bend.step(1).hash, first]


def test_pickles_of_another_version_are_refused(bend):
    for thing in (bend.state, bend.snapshot()):
        make, parts = copyreg.dispatch_table[type(thing)](thing)
        for wrong in ((parts[0] + "1", *parts[1:]), parts[1:], (5, *parts[1:])):
            with pytest.raises(sd.InputError, match="pickle: expected one of seldinger"):
                make(*wrong)


def test_what_is_shown_of_states_snapshots_and_simulations(bend, cobra):
    assert repr(bend).startswith("<Simulation s_bend: State of frame -1: wire with its tip at (")
    state = bend.step(1)
    assert repr(state).startswith("<State of frame 0: wire with its tip at (") and " mm from the target" in repr(state)
    assert repr(cobra.state).startswith("<State of frame -1: catheter with")
    assert repr(bend.snapshot()) == f"<Snapshot of 1 frames, {len(bend.snapshot())} bytes>"
    made = state.asdict()
    assert list(made) == [name for name in made if getattr(state, name) is not None] and made["frame"] == 0
    assert set(made) == {name for name in dir(state) if not name.startswith("_") and name != "asdict"}
    assert bend._repr_png_().startswith(b"\x89PNG")
