import copy
import gc
import os
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import seldinger as sd


def resident_kB():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))


def states_of(recording):
    return [line.split()[1:] for line in open(recording) if line.startswith("state ")]


def test_state_has_the_shapes_and_units_that_are_documented(renal):
    s = renal.step(advance_mm=2, rotate_deg=10)
    n = len(s.wire_mm)
    assert s.frame == 0 and s.time_s == pytest.approx(1 / 15)
    assert s.wire_mm.shape == (n, 3) and s.wire_px.shape == (n, 2) and s.wire_mm.dtype == np.float64
    assert s.joint_force_N.shape == (n,) and (s.joint_force_N >= 0).all()
    assert s.joint_force_N.max() == s.wall_force_N and s.joint_force_N[-1] == s.tip_force_N
    assert s.catheter_mm.shape == (0, 3)
    assert s.inserted_mm == pytest.approx(82) and s.turned_deg == pytest.approx(10)
    assert np.linalg.norm(s.tip_direction) == pytest.approx(1)
    np.testing.assert_array_equal(s.tip_mm, s.wire_mm[-1])
    np.testing.assert_array_equal(s.tip_px, s.wire_px[-1])
    assert s.tip_to_target_mm == pytest.approx(np.linalg.norm(s.tip_mm - s.target_mm))
    assert s.path_to_target_mm > s.tip_to_target_mm
    assert s.branch in [branch["name"] for branch in renal.anatomy()["branches"]]
    assert s.at_rest and s.certified and not s.settling


def test_every_public_member_has_a_docstring():
    for thing in (sd.Simulation, sd.VectorSimulation, sd.State):
        for name in dir(thing):
            if not name.startswith("_"):
                assert getattr(thing, name).__doc__ if name not in thing.__dict__.get("__annotations__", {}) else True
    assert "frames" in sd.Simulation.step.__doc__ and "[mm]" in sd.Simulation.step.__doc__


def test_arrays_of_a_state_stay_when_the_simulation_goes_on(bend):
    first = bend.step(advance_mm=2)
    before = first.wire_mm.copy()
    bend.step(advance_mm=5)
    np.testing.assert_array_equal(first.wire_mm, before)


def test_an_attempt_replays_in_the_program_to_the_same_states(renal, program, cache, tmp_path):
    rng = np.random.default_rng(3)
    renal.apply("beam on")
    for _ in range(25):
        state = renal.step(advance_mm=rng.uniform(-1, 3), rotate_deg=rng.uniform(-20, 20))
    renal.save(tmp_path / "python.gw")
    result = subprocess.run([program, "run", "renal", "--commands", tmp_path / "python.gw", "--out", tmp_path / "out",
                             "--frames", "none", "--cache", cache, "--expect", tmp_path / "python.gw"],
                            capture_output=True, text=True)
    assert result.returncode in (0, 1), result.stderr
    assert "states and 0 frames compared, all equal" in result.stdout
    assert states_of(tmp_path / "python.gw")[-1] == ["24", f"{state.hash:016x}"]
    assert states_of(tmp_path / "out" / "run.gw")[-1] == ["24", f"{state.hash:016x}"]


def test_restored_snapshots_go_on_bit_for_bit(cobra):
    cobra.step(advance_mm=2, catheter_advance_mm=3)
    snapshot = cobra.snapshot()

    def go_on():
        states = [cobra.step(advance_mm=1, rotate_deg=5, catheter_advance_mm=-1) for _ in range(6)]
        return [(s.hash, s.push_N, s.catheter_torque_Nmm, s.turned_deg) for s in states]

    first = go_on()
    assert cobra.restore(snapshot).hash != first[-1][0]
    assert go_on() == first


def test_a_restored_state_has_the_hash_that_it_had(cobra):
    start = cobra.state.hash
    for _ in range(4):
        cobra.step(advance_mm=1, rotate_deg=10, catheter_advance_mm=1, catheter_rotate_deg=10)
    snapshot, hash_then = cobra.snapshot(), cobra.state.hash
    assert cobra.reset().hash == start
    assert cobra.restore(snapshot).hash == hash_then


def test_a_snapshot_keeps_the_recording_of_its_branch(bend, tmp_path):
    bend.step(advance_mm=1)
    snapshot = bend.snapshot()
    bend.step(advance_mm=7)
    bend.restore(snapshot)
    bend.step(advance_mm=2)
    bend.save(tmp_path / "run.gw")
    text = (tmp_path / "run.gw").read_text()
    assert "1 advance 2 mm" in text and "advance 7 mm" not in text


def test_a_snapshot_of_another_exercise_is_rejected(bend, renal):
    before = renal.step(advance_mm=1).hash
    with pytest.raises(sd.InputError, match="another exercise"):
        renal.restore(bend.snapshot())
    assert renal.state.hash == before


def test_reset_restores_the_start_bit_for_bit(renal):
    start = renal.state.hash
    first = [renal.step(advance_mm=2, rotate_deg=30).hash for _ in range(5)]
    assert renal.reset().hash == start
    assert [renal.step(advance_mm=2, rotate_deg=30).hash for _ in range(5)] == first


def test_reset_with_another_target_aims_at_it(renal):
    target = renal.anatomy()["targets"][0]
    state = renal.reset(target=target["name"], radius_mm=4)
    np.testing.assert_allclose(state.target_mm, target["centre_mm"])
    inside = renal.anatomy()["branches"][0]["points_mm"][40]
    assert np.allclose(renal.reset(target=inside).target_mm, inside)
    assert np.allclose(renal.reset().target_mm, inside)
    with pytest.raises(sd.InputError, match="outside the anatomy"):
        renal.reset(target=[0, 0, 5000])
    with pytest.raises(sd.InputError, match="no target of"):
        renal.reset(target="nowhere")


def test_commands_take_effect_with_the_next_step_and_images_see_the_arm_before(bend):
    before = bend.image(64)
    camera = bend.camera_matrix(64)
    bend.apply("arm lao 30 deg")
    assert not np.array_equal(bend.camera_matrix(64), camera)
    assert not np.array_equal(bend.image(64), before)
    assert bend.step().frame == 0


def test_images_depend_on_the_state_alone(renal):
    renal.step(advance_mm=2)
    snapshot = renal.snapshot()
    first = renal.image(96)
    assert first.shape == (96, 96) and first.dtype == np.uint8 and first.std() > 5
    renal.step(advance_mm=20)
    assert not np.array_equal(renal.image(96), first)
    renal.image(64, mode="dsa")
    renal.restore(snapshot)
    np.testing.assert_array_equal(renal.image(96), first)
    assert not np.array_equal(renal.image(96, seed=77), first)


def test_the_wire_is_dark_where_its_mask_is(renal):
    for _ in range(10):
        state = renal.step(advance_mm=4)
    image, masks = renal.image(256, mode="dsa").astype(float), renal.masks(256)
    wire, vessels = masks["wire"] == 255, masks["vessels"] == 255
    assert set(np.unique(masks["wire"])) == {0, 255} and "catheter" not in masks
    around = np.zeros_like(wire)
    for dx in range(-6, 7):
        around |= np.roll(wire, dx, 1)
    assert image[wire].mean() < image[around & ~wire].mean() - 10
    x, y = renal.project(state.wire_mm, 256)[-3].astype(int)
    assert wire[y - 1:y + 2, x - 1:x + 2].any() and vessels[y, x]


def test_masks_follow_the_wire(renal):
    first = renal.masks(128)["wire"].copy()
    renal.step(advance_mm=10)
    second = renal.masks(128)["wire"]
    assert (first != second).any()
    np.testing.assert_array_equal(renal.masks(128)["wire"], second)


def test_the_screen_shows_what_a_run_of_the_program_writes(program, cache, tmp_path):
    with sd.Simulation("s_bend", images=True, cache=cache) as sim:
        sim.apply("beam on")
        for _ in range(4):
            sim.step(advance_mm=2)
        shown = sim.image(mode="screen")
        assert sim.score()["air_kerma_mGy"] > 0
    (tmp_path / "a.gw").write_text("0 beam on\n0..3 advance 2 mm\n3 end\n")
    subprocess.run([program, "run", "s_bend", "--commands", tmp_path / "a.gw", "--out", tmp_path / "out", "--cache",
                    cache], capture_output=True)
    sd.write_png(tmp_path / "shown.png", shown)
    assert (tmp_path / "shown.png").read_bytes() == (tmp_path / "out" / "frames" / "frame_000003.png").read_bytes()


def test_the_screen_has_the_scenarios_pixels_alone(cache):
    with sd.Simulation("s_bend", images=True, set={"c_arm.pixels": 64}, cache=cache) as sim:
        assert sim.image(mode="screen").shape == sim.image(64, mode="screen").shape == (64, 64)
        with pytest.raises(sd.InputError, match="96 pixels was asked for; it has 64"):
            sim.image(96, mode="screen")


def test_png_files_are_of_bytes_or_truth_values(tmp_path):
    grey = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
    sd.write_png(tmp_path / "a.png", grey)
    sd.write_png(tmp_path / "b.png", np.asfortranarray(grey))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    sd.write_png(tmp_path / "a.png", grey > 100)
    sd.write_png(tmp_path / "b.png", (grey > 100).astype(np.uint8) * 255)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    (tmp_path / "b.png").unlink()
    for other in (grey.astype(float), grey.astype(np.int64) + 1000, np.full((3, 4), np.nan), grey.astype(np.int8) - 1,
                  [[1, 2], [3, 4]], [["a"]], "a", None, grey[0], np.zeros((2, 2, 4), np.uint8), grey[:0]):
        with pytest.raises(sd.InputError, match="uint8 or bool"):
            sd.write_png(tmp_path / "b.png", other)
    assert not (tmp_path / "b.png").exists()


TUBE = {"title": "A tube", "seed": 4, "tube": {"path": [{"run_mm": 150}], "radius_mm": 3.0},
        "entry": {"end": "start", "inserted_mm": 60}, "target": {"centre_mm": [100, 0, 0], "radius_mm": 3.0},
        "imaging": {"patient": False}}


@pytest.mark.parametrize("title", ["wire \U0001f600", "\u00e9\u4e2d", "a\x7fb", 'a"b\\c', "a\tb"])
def test_texts_of_a_dict_reach_the_scenario_as_they_are(cache, title):
    with sd.Simulation(dict(TUBE, title=title), cache=cache) as sim:
        assert sim.about()["title"] == title
    with sd.Simulation("s_bend", set={"title": title}, cache=cache) as sim:
        assert sim.about()["title"] == title


@pytest.mark.parametrize("wrong", [{"title": "\ud800"}, {"schema": "1\ntime_limit_s = 3"}, {"schema": 2},
                                   {"title": None}, {"nothing": 1}])
def test_a_dict_that_is_no_scenario_is_refused(cache, wrong):
    with pytest.raises(sd.InputError):
        sd.Simulation(dict(TUBE, **wrong), cache=cache)


@pytest.mark.parametrize("values, says", [({5: 1}, "the key 5"), ([("a", 1)], "set: list"), ({"a.b": None}, "a.b")])
def test_values_that_are_none_are_refused(cache, values, says):
    with pytest.raises(sd.InputError, match=says):
        sd.Simulation("s_bend", set=values, cache=cache)


def test_arrays_of_numpy_without_dimension_are_numbers(cache):
    values = {"time_limit_s": np.array(60.0), "seed": np.array(3), "target.radius_mm": np.float32(2.5)}
    with sd.Simulation("s_bend", set=values, cache=cache) as sim:
        assert sim.about()["time_limit_s"] == 60 and sim.about()["target_radius_mm"] == 2.5


# The paper's relaxers know neither friction nor torsion.
PLAIN = {"guidewire": {"device": "glide035", "frictionless": True}, "chain": {"torsion": "rigid"}}
RELAXERS = ("global", "segment", "first-order", "geometric", "combined", "konings")


@pytest.mark.parametrize("wall", ["analytic", "distance-field", "mesh"])
@pytest.mark.parametrize("kind", RELAXERS)
def test_walls_and_relaxers_of_the_paper_make_frames_that_repeat(cache, wall, kind):
    # Those of the paper spend all of it in every frame; the global one stops at rest.
    updates = 20000 if kind == "global" else 5000
    scenario = dict(TUBE, **PLAIN, wall={"model": wall}, relaxer={"kind": kind, "updates_per_frame": updates})
    with sd.Simulation(scenario, cache=cache) as sim:
        def go_on():
            return [sim.step(advance_mm=2, rotate_deg=5) for _ in range(4)]
        first = go_on()
        snapshot = sim.snapshot()
        later = go_on()
        assert first[-1].frame == 3 and np.isfinite(first[-1].wire_mm).all()
        assert later[-1].inserted_mm == pytest.approx(76)
        # The wire lies in the tube, 3 mm wide, along the x axis.
        assert (np.linalg.norm(later[-1].wire_mm[:, 1:], axis=1) < 3.5).all()
        sim.restore(snapshot)
        assert [state.hash for state in go_on()] == [state.hash for state in later]
        sim.reset()
        assert [state.hash for state in go_on()] == [state.hash for state in first]


def test_walls_and_relaxers_may_be_set(cache):
    hashes = set()
    for values in ({}, {"wall.model": "mesh"}, {"relaxer.kind": "konings", "guidewire.frictionless": True, "chain.torsion": "rigid"}):
        with sd.Simulation("s_bend", set=values, cache=cache) as sim:
            sim.step(advance_mm=3, frames=3)
            hashes.add(sim.state.hash)
    assert len(hashes) == 3
    for values in ({"wall.model": "brick"}, {"relaxer.kind": "fast"}, {"relaxer.varied_segments": 9}):
        with pytest.raises(sd.InputError, match=next(iter(values)).split(".")[1]):
            sd.Simulation("s_bend", set=values, cache=cache)


def test_a_scenario_may_be_a_dict(cache):
    scenario = dict(TUBE, entry={"end": "far", "inserted_mm": 60})
    with pytest.raises(sd.InputError, match="ends are: (.*)") as error:
        sd.Simulation(scenario, cache=cache)
    scenario["entry"]["end"] = str(error.value).rsplit(": ", 1)[1].split(", ")[0]
    with sd.Simulation(scenario, cache=cache) as sim:
        assert sim.about()["title"] == "A tube"
        assert sim.step(advance_mm=1).inserted_mm == pytest.approx(61)


def test_values_may_take_the_place_of_the_scenarios(cache):
    with sd.Simulation("s_bend", set={"entry.inserted_mm": 30, "c_arm.pixels": 64}, cache=cache) as sim:
        assert sim.state.inserted_mm == pytest.approx(30) and sim.image().shape == (64, 64)


NOWHERE = [[wrong if i == k else 1.0 for i in range(3)] for k in range(3)
           for wrong in (np.nan, np.inf, -np.inf, 1e300, -10000.1)] + [[np.nan] * 3]


@pytest.mark.parametrize("do, says", [
    (lambda sim: sim.step(float("nan")), "advance_mm: nan mm was given; expected -500"),
    (lambda sim: sim.step(rotate_deg=1e9), "rotate_deg"),
    (lambda sim: sim.step(frames=0), "frames: 0"),
    (lambda sim: sim.step(1, device="probe"), "'all', found 'probe'; the scenario has 'wire' (0)"),
    (lambda sim: sim.step(1, device=1), "'all', found 1; the scenario has 'wire' (0)"),
    (lambda sim: sim.apply("arm lao 300 deg"), "a number from -120 to 120"),
    (lambda sim: sim.apply("fly"), "'fly'"),
    (lambda sim: sim.apply("beam on\nbeam off"), "one line"),
    (lambda sim: sim.apply("end"), "one command"),
    (lambda sim: sim.image(8), "32 to 2048"),
    (lambda sim: sim.image(64, mode="colour"), "'live', 'dsa', 'screen' or 'cine'"),
    (lambda sim: sim.image(64, mode="screen"), "images=True"),
    (lambda sim: sim.step(1, device=2 ** 70), "found 1180591620717411303424"),
    (lambda sim: sim.step(1, device=np.array([0.5])), "found array([0.5])"),
    (lambda sim: sim.reset(target=[1e300] * 3), "10000 in size"),
    (lambda sim: sim.reset(target=[0, 0, -10001]), "10000 in size"),
    (lambda sim: sim.reset(target=["a", "b", "c"]), "target: ['a', 'b', 'c'] was given"),
    (lambda sim: sim.reset(target=["1", "2", "3"]), "three finite coordinates"),
    (lambda sim: sim.reset(target={}), "target: {} was given"),
    (lambda sim: sim.reset(target=object()), "three finite coordinates"),
    (lambda sim: sim.reset(target=b"x"), "target: b'x' was given"),
    (lambda sim: sim.reset(target=[[1, 2], [3]]), "three finite coordinates"),
    (lambda sim: sim.reset(target=[1j, 0, 0]), "three finite coordinates"),
    *[(lambda sim, place=place: sim.reset(target=place), "target: ") for place in NOWHERE],
    *[(lambda sim, place=place: sim.path_from(place), "place_mm: ") for place in NOWHERE],
    (lambda sim: sim.path_from([np.inf, 0, 0]), "place_mm"),
    (lambda sim: sim.path_from([0, 1e300, 0]), "place_mm"),
    (lambda sim: sim.path_from([1, 2]), "place_mm"),
    (lambda sim: sim.path_from("abc"), "place_mm"),
    (lambda sim: sim.project([1, 2, 3]), "shape"),
    (lambda sim: sim.save("/nowhere/at/all.gw"), "/nowhere"),
])
def test_bad_input_is_named_and_changes_nothing(bend, do, says):
    before = bend.step(advance_mm=1).hash
    with pytest.raises(sd.InputError, match=re.escape(says)):
        do(bend)
    assert bend.state.hash == before and bend.state.frame == 0


def test_a_step_that_is_refused_keeps_what_was_asked_for(bend):
    bend.apply("arm lao 30 deg")
    camera = bend.camera_matrix()
    with pytest.raises(sd.InputError, match="the scenario has none"):
        bend.step(catheter_advance_mm=1)
    np.testing.assert_array_equal(bend.camera_matrix(), camera)
    bend.step()
    np.testing.assert_array_equal(bend.camera_matrix(), camera)


def test_an_injection_that_is_rejected_is_forgotten_alone_and_leaves_the_frame_unmade(renal):
    before = renal.step(advance_mm=1).hash
    renal.apply("arm lao 30 deg")
    camera = renal.camera_matrix()
    renal.apply("inject 5 ml at 5 ml/s into nowhere")
    with pytest.raises(sd.InputError, match="nowhere"):
        renal.step(advance_mm=3)
    np.testing.assert_array_equal(renal.camera_matrix(), camera)
    assert renal.state.hash == before and renal.state.frame == 0
    assert renal.step(advance_mm=3).frame == 1
    np.testing.assert_array_equal(renal.camera_matrix(), camera)


def test_whole_numbers_of_numpy_name_a_device(bend):
    first = bend.step(1, device=np.int64(0)).hash
    bend.reset()
    assert bend.step(1, device="wire").hash == first


def test_errors_of_a_scenario_have_the_text_of_the_program(program, cache, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text('schema = 1\ntitle = "x"\n[entry]\nend = 3\n[target]\nname = "LRA"\nradius_mm = -1\n')
    with pytest.raises(sd.InputError) as error:
        sd.Simulation(file, cache=cache)
    result = subprocess.run([program, "run", file, "--commands", "-", "--out", tmp_path / "out"], input="",
                            capture_output=True, text=True)
    assert result.stderr.strip() == "seldinger: " + str(error.value)
    assert f"{file}:7:" in str(error.value) and isinstance(error.value, ValueError)


def test_unknown_names_list_those_that_ship():
    with pytest.raises(sd.InputError, match="renal"):
        sd.Simulation("kidney")
    with pytest.raises(sd.InputError, match="a name, a file or a dict"):
        sd.Simulation(7)


def test_a_closed_simulation_says_so(bend):
    bend.close()
    assert bend.closed
    for call in (bend.step, bend.snapshot, bend.reset, bend.image, bend.masks, bend.about, bend.score):
        with pytest.raises(sd.InputError, match="closed"):
            call()


def test_other_threads_run_while_a_step_is_made(renal):
    ticks = [0]
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks[0] += 1
            time.sleep(0)

    thread = threading.Thread(target=tick)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(3600)  # a thread gives way only where it lets the interpreter go
    during = 0
    try:
        thread.start()
        # Counted over steps alone. On a busy machine the other thread may get no processor during the first of them, so
        # that they go on until it had one; a step that keeps the interpreter to itself never ends the loop with a tick.
        for _ in range(500):
            before = ticks[0]
            renal.step(advance_mm=0.01, frames=20)
            during += ticks[0] - before
            if during > 0:
                break
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        thread.join()
    assert during > 0


def test_two_threads_may_use_one_simulation(bend):
    def many():
        for _ in range(20):
            bend.step(advance_mm=0.1)

    threads = [threading.Thread(target=many) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert bend.state.frame == 59


def test_accessors_wait_for_a_thread_that_changes_the_simulation(renal):
    here = renal.anatomy()["branches"][0]["points_mm"][40]
    about, camera, place = renal.about(), renal.camera_matrix(), renal.project([[1, 2, 3]])
    names = [branch["name"] for branch in renal.anatomy()["branches"]]
    wrong, errors = [], []

    def change():
        for k in range(30):
            renal.reset(target=here if k % 2 else "LRA", radius_mm=4 + k % 2)
            renal.step(advance_mm=1)

    def look():
        for _ in range(60):
            now = renal.about()
            now["target_radius_mm"] = about["target_radius_mm"]
            if now != about or renal.path_from(here) is None or renal.closed:
                wrong.append(now)
            if not (np.array_equal(renal.camera_matrix(), camera) and np.array_equal(renal.project([[1, 2, 3]]), place)):
                wrong.append("camera")
            if [branch["name"] for branch in renal.anatomy()["branches"]] != names:
                wrong.append("anatomy")

    def kept(work):
        try:
            work()
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=kept, args=(work,)) for work in (change, look, change, look)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong and not errors


def test_a_simulation_may_be_closed_while_others_use_it(bend):
    for _ in range(30):
        sim = copy.deepcopy(bend)
        errors = []

        def use():
            try:
                while True:
                    sim.step(advance_mm=0.01)
                    sim.project([[0, 0, 0]])
                    sim.about()
            except Exception as error:
                errors.append(error)

        threads = [threading.Thread(target=use) for _ in range(2)]
        for thread in threads:
            thread.start()
        sim.close()
        for thread in threads:
            thread.join()
        assert [type(error) for error in errors] == [sd.InputError] * 2 and "closed" in str(errors[0])


def test_ctrl_c_ends_a_long_step(cache):
    text = ("import seldinger as sd, sys\n"
            f"sim = sd.Simulation('s_bend', cache={str(cache)!r})\n"
            "print('ready', flush=True)\n"
            "try:\n    sim.step(frames=1000000)\n"
            "except KeyboardInterrupt:\n    print('ended', sim.state.frame < 999999, sim.step().at_rest)\n")
    process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[0] == "ended True True\n"


def test_ctrl_c_ends_the_growth_of_vessels(tmp_path):
    text = ("import seldinger as sd\n"
            f"try:\n    sd.Simulation('renal', cache={str(tmp_path)!r}, set={{'anatomy.seed': 12345}})\n"
            "except KeyboardInterrupt:\n    print('ended')\n")
    process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True)
    while process.poll() is None and not any(tmp_path.iterdir()):  # a lock is there as soon as the growth begins
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=120)[0] == "ended\n"


def test_memory_does_not_grow_with_resets_and_snapshots(bend):
    def work(times):
        for _ in range(times):
            bend.reset()
            bend.step(advance_mm=1)
            bend.restore(bend.snapshot())

    work(500)
    gc.collect()
    before = resident_kB()
    work(3000)
    gc.collect()
    assert resident_kB() - before < 2000


def test_a_long_recording_is_freed_without_recursion(cache):
    # In threads of little stack, where a call for each frame of the recording would not fit.
    text = f"""
import threading, numpy as np, seldinger as sd
threading.stack_size(512 * 1024)
def apart(work):
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
with sd.Simulation("s_bend", cache={str(cache)!r}) as sim, sd.VectorSimulation(sim, 1, threads=1) as many:
    start = sim.snapshot()
    frames = 30000
    sim.step(frames=frames)
    apart(sim.reset)
    sim.step(frames=frames)
    apart(lambda: sim.restore(start))
    sim.step(frames=frames)
    kept = [sim.snapshot()]
    sim.reset()
    apart(kept.clear)
    many.step(np.zeros((1, 1, 2)), frames=frames)
    apart(many.reset)
    sim.step(frames=frames)
    apart(sim.close)
    print(many.frame[0])
"""
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert (result.returncode, result.stdout) == (0, "-1\n"), result.stderr


def test_importing_is_light():
    text = "import sys, seldinger; print(','.join(sorted({'gymnasium', 'torch', 'matplotlib'} & set(sys.modules))))"
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert result.stdout == "\n" and result.returncode == 0, result.stderr


def test_the_stubs_name_what_the_module_has(cache):
    import ast
    from pathlib import Path

    from seldinger import _core
    tree = ast.parse((Path(_core.__file__).parent / "_core.pyi").read_text())
    stubs = {node.name: {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
             for node in tree.body if isinstance(node, ast.ClassDef)}
    for name, members in stubs.items():
        if name == "InputError":
            continue
        there = {one for one in vars(getattr(_core, name)) if not one.startswith("__")
                 and not one.startswith("_pybind")}
        if name == "VectorSimulation":  # its arrays are attributes of what is made
            with sd.VectorSimulation("s_bend", 1, threads=1, cache=cache) as many:
                there |= set(many._arrays)
        assert {one for one in members if not one.startswith("__")} == there, name
    assert (Path(_core.__file__).parent / "py.typed").exists()
