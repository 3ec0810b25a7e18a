import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import seldinger as sd


def assert_equal(a, b, name):
    """Field by field: what is absent is NaN, in both."""
    for field in a.dtype.names or [...]:
        np.testing.assert_array_equal(a[field], b[field], err_msg=f"{name} {field}")


def episodes(like, n, threads, frames=12, seed=5):
    """Hashes after each frame, and all arrays at the end."""
    with sd.VectorSimulation(like, n, threads=threads, points=4) as many:
        rng = np.random.default_rng(seed)
        hashes = []
        for _ in range(frames):
            motions = rng.uniform([-1, -0.3], [4, 0.3], (n, like.about()["devices"], 2))
            many.step(motions)
            hashes.append(many.hashes())
        return np.array(hashes), {name: array.copy() for name, array in many._arrays.items()}


@pytest.mark.parametrize("name", ["s_bend", "renal_cobra"])
def test_results_do_not_depend_on_the_number_of_threads(cache, name):
    with sd.Simulation(name, cache=cache) as like:
        one, arrays_of_one = episodes(like, 7, 1)
        for threads in (2, 3):
            some, arrays = episodes(like, 7, threads)
            np.testing.assert_array_equal(one, some)
            for key, array in arrays.items():
                assert_equal(array, arrays_of_one[key], key)
        assert len(np.unique(one[-1])) == 7


def test_one_of_many_is_the_same_as_one_alone(renal):
    with sd.VectorSimulation(renal, 3, threads=2, points=5, spacing_mm=3) as many:
        for k in range(8):
            motions = np.zeros((3, 1, 2))
            motions[1, 0] = 2.0, np.radians(7)
            many.step(motions)
            state = renal.step(advance_mm=2.0, rotate_deg=7)
        assert int(many.hashes()[1]) == state.hash
        np.testing.assert_array_equal(many.tip_mm[1], state.tip_mm)
        np.testing.assert_array_equal(many.tip_px[1], state.tip_px)
        assert many.path_to_target_mm[1] == state.path_to_target_mm and many.push_N[1, 0] == state.push_N
        assert np.degrees(many.turned_rad[1, 0]) == pytest.approx(state.turned_deg)
        assert many.branch_name(1) == state.branch and many.frame.tolist() == [7, 7, 7]
        np.testing.assert_array_equal(many.track_mm[1, 0], state.tip_mm)
        gaps = np.linalg.norm(np.diff(many.track_mm[1], axis=0), axis=1)
        assert (gaps <= 3 + 1e-9).all() and (gaps > 2.5).all()
        np.testing.assert_allclose(many.track_px[1], renal.project(many.track_mm[1]))
        np.testing.assert_array_equal(many.images(64)[1], renal.image(64))
        np.testing.assert_array_equal(many.masks(64)["vessels"][1], renal.masks(64)["vessels"])
        assert many.score(1)["wire_travel_mm"] == renal.score()["wire_travel_mm"]


def test_images_do_not_depend_on_the_number_of_threads(bend):
    made = []
    for threads in (1, 2):
        with sd.VectorSimulation(bend, 4, threads=threads) as many:
            many.step(np.arange(8.0).reshape(4, 1, 2) * 0.2)
            made.append((many.images(48, seeds=[1, 2, 3, 4]), many.images(48, "dsa"), many.masks(48)["wire"]))
    for a, b in zip(*made):
        np.testing.assert_array_equal(a, b)


def test_arrays_are_made_once_and_written_by_each_step(bend):
    with sd.VectorSimulation(bend, 2, threads=1) as many:
        tips = many.tip_mm
        before = tips.copy()
        many.step(np.full((2, 1, 2), 1.0))
        assert many.tip_mm is tips and (tips != before).any()


def test_only_active_ones_step_and_only_those_named_are_reset(bend):
    with sd.VectorSimulation(bend, 3, threads=2) as many:
        start = many.hashes()
        many.step(np.full((3, 1, 2), 1.0), active=np.array([True, False, True]))
        assert many.frame.tolist() == [0, -1, 0]
        many.reset(np.array([True, False, False]))
        assert (many.hashes() == start).tolist() == [True, True, False]


def test_different_scenarios_stand_side_by_side(bend, renal):
    with sd.VectorSimulation([renal, bend, renal], threads=2) as many:
        many.step(np.full((3, 1, 2), 0.5))
        assert int(many.hashes()[0]) == int(many.hashes()[2]) != int(many.hashes()[1])
        assert many.save(1, "/dev/null") is None


def test_snapshots_of_one_of_many_go_on_bit_for_bit(bend):
    with sd.VectorSimulation(bend, 2, threads=2) as many:
        many.step(np.full((2, 1, 2), 1.0))
        snapshot = many.snapshot(0)
        many.step(np.full((2, 1, 2), 0.7))
        after = many.hashes()
        many.restore(0, snapshot)
        many.step(np.full((2, 1, 2), 0.7), active=np.array([True, False]))
        np.testing.assert_array_equal(many.hashes(), after)


def test_a_motion_of_a_device_that_a_scenario_lacks_names_those_it_has(bend, cobra):
    with sd.VectorSimulation([bend, cobra], threads=1) as many:
        with pytest.raises(sd.InputError, match=r"^simulation 0: .* device 1; the scenario has 'wire' \(0\)$"):
            many.step(np.full((2, 2, 2), 0.1))
        with pytest.raises(sd.InputError, match=r"\(2, 1 to 2, 2\), .*; the devices are 'wire' \(0\) and 'catheter' \(1\)$"):
            many.step(np.zeros((2, 3, 2)))
        many.step(np.array([[[0.1, 0], [0, 0]], [[0.1, 0], [0.1, 0]]]))


@pytest.mark.parametrize("do, says", [
    (lambda many: many.step(np.zeros((2, 1, 3))), r"found \(2, 1, 3\); the devices are 'wire' \(0\)$"),
    (lambda many: many.step(np.zeros(4)), r"found \(4,\)"),
    (lambda many: many.step(np.full((2, 1, 2), np.nan)), "nan"),
    (lambda many: many.step(np.full((2, 2, 2), 1.0)),
     r"^motions: expected an array of shape \(2, 1, 2\), .*, found \(2, 2, 2\); the devices are 'wire' \(0\)$"),
    (lambda many: many.reset(np.array([True])), "2 truth values"),
    (lambda many: many.images(8), "32 to 2048"),
    (lambda many: many.images(64, seeds=[1]), "one for each"),
    (lambda many: many.aim(0, [0, 0, 9000]), "outside"),
    (lambda many: many.aim(0, ["a", "b", "c"]), "three finite coordinates"),
    (lambda many: many.aim(0, [np.nan] * 3), "three finite coordinates"),
    (lambda many: many.aim(0, None), "None was given"),
    (lambda many: many.path_from(0, [np.nan] * 3), "place_mm"),
    (lambda many: many.step(np.zeros((2, 1, 2)), active=np.array([0, 1])), "active: .* a mask, an array of 2 truth values"),
    (lambda many: many.reset(np.array([0, 1])), "which: .* a mask"),
    (lambda many: many.step(np.zeros((2, 1, 2)), frames=0), "frames: 0"),
    (lambda many: many.images(64, "screen"), "images=True"),
])
def test_bad_input_is_named(bend, do, says):
    with sd.VectorSimulation(bend, 2, threads=2) as many:
        with pytest.raises(sd.InputError, match=says):
            do(many)
        assert many.frame.tolist() == [-1, -1]
        many.step(np.zeros((2, 1, 2)))


def test_numbers_out_of_range_are_named(bend):
    for arguments, says in (((0,), "n: 0"), ((2, ), "threads: 0")):
        with pytest.raises(sd.InputError, match=says):
            sd.VectorSimulation(bend, *arguments, threads=0 if "threads" in says else 1)
    with pytest.raises(IndexError):
        sd.VectorSimulation(bend, 1).snapshot(1)


def test_a_simulation_with_a_screen_cannot_be_shared(cache):
    with sd.Simulation("s_bend", images=True, cache=cache) as sim:
        with pytest.raises(sd.InputError, match="cannot be shared"):
            sd.VectorSimulation(sim, 2)


def test_masks_may_be_lists_and_views(bend):
    with sd.VectorSimulation(bend, 3, threads=1) as many:
        many.step(np.zeros((3, 1, 2)), active=[True, False, True])
        many.step(np.zeros((3, 1, 2)), active=np.array([True, False, False, True, False, True])[::2])
        assert many.frame.tolist() == [1, -1, 0]


def test_an_aim_that_fails_leaves_the_arrays_as_the_state_is(bend):
    with sd.VectorSimulation(bend, 2, threads=1) as many:
        start = {name: array.copy() for name, array in many._arrays.items()}
        many.step(np.full((2, 1, 2), 1.0), frames=5)
        with pytest.raises(sd.InputError, match="outside"):
            many.aim(0, [0, 0, 9000])
        for name, array in many._arrays.items():
            assert_equal(array[0], start[name][0], name)
        assert many.frame.tolist() == [-1, 4]
        many.reset()
        assert many.hashes()[0] == many.hashes()[1]


def test_closed_simulations_say_so(bend):
    many = sd.VectorSimulation(bend, 2, threads=1)
    snapshot, tips = many.snapshot(0), many.tip_mm
    assert not many.closed
    many.close()
    many.close()
    assert many.closed and len(many) == 2 and np.isfinite(tips).all()
    for call in (lambda: many.step(np.zeros((2, 1, 2))), lambda: many.step(np.zeros((0, 1, 2))), lambda: many.reset(),
                 lambda: many.aim(0, [0, 0, 0]), lambda: many.apply(0, "beam on"), lambda: many.assign(0, bend),
                 lambda: many.hashes(), lambda: many.branch_name(0), lambda: many.score(0),
                 lambda: many.save(0, "/dev/null"), lambda: many.snapshot(0), lambda: many.restore(0, snapshot),
                 lambda: many.images(32), lambda: many.masks(32), lambda: many.panel(0),
                 lambda: many.path_from(0, [0, 0, 0])):
        with pytest.raises(sd.InputError, match="closed"):
            call()


def test_simulations_may_be_closed_while_they_step(bend):
    for _ in range(20):
        many = sd.VectorSimulation(bend, 8, threads=2)
        errors, begun = [], threading.Event()

        def use():
            try:
                while True:
                    many.step(np.full((8, 1, 2), 0.01))
                    begun.set()
                    many.branch_name(0)
            except Exception as error:
                errors.append(error)

        thread = threading.Thread(target=use)
        thread.start()
        begun.wait()
        many.close()
        thread.join()
        assert [type(error) for error in errors] == [sd.InputError] and "closed" in str(errors[0])


def test_there_are_256_threads_at_most(bend, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(384)))
    with sd.VectorSimulation(bend, 1) as many:
        assert many.threads == 256


@pytest.mark.parametrize("whole, long", [
    ("sd.VectorSimulation(sim, 1000, threads=1)", "sd.VectorSimulation(sim, 100000, threads=1)"),
    ("many.images(512)", "many.images(512)")])
def test_ctrl_c_ends_a_long_call_between_its_parts(cache, whole, long):
    # The signal comes, and the end is measured, after so much work of the processor, however busy the machine is.
    text = f"""
import signal, time, numpy as np, seldinger as sd
def interrupt(*_):
    raise KeyboardInterrupt
signal.signal(signal.SIGPROF, interrupt)
sim = sd.Simulation("s_bend", cache={str(cache)!r})
many = sd.VectorSimulation(sim, 64, threads=1)
many.step(np.linspace(1, 5, 128).reshape(64, 1, 2))
many.images(512)
begin = time.process_time()
{whole}
whole = time.process_time() - begin
signal.setitimer(signal.ITIMER_PROF, whole / 5)
begin = time.process_time()
try:
    {long}
    signal.setitimer(signal.ITIMER_PROF, 0)
except KeyboardInterrupt:
    print((time.process_time() - begin) / whole)
"""
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert result.returncode == 0 and float(result.stdout or "inf") < 0.8, result.stderr + result.stdout
