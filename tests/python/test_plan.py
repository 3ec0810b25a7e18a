"""Plans of a case as objects."""

import subprocess
import threading

import numpy as np
import pytest

import seldinger as sd

FORK = {
    "title": "Fork", "frame_rate_hz": 15,
    "anatomy": {"branch": [{"name": "trunk", "points_mm": [[0, 0, 130, 4], [0, 0, 60, 4], [0, 0, 0, 4]]},
                           {"name": "side", "parent": "trunk", "at_mm": 60,
                            "points_mm": [[0, 0, 0, 3], [20, 0, 20, 3], [40, 0, 40, 3]]}],
                "target": [{"name": "goal", "branch": "side", "at_mm": 25}]},
    "entry": {"end": "trunk.out", "inserted_mm": 40}, "guidewire": {"device": "glide035"},
    "wall": {"stiffness_N_per_mm": 20.0}, "target": {"name": "goal", "radius_mm": 5.0, "hold_s": 0.3},
}


@pytest.fixture(scope="module")
def plans(cache):
    return sd.plan(FORK, devices="glidestraight035,own", frames=3000, cache=cache)


def test_the_best_course_reaches_the_target_in_a_simulation(plans, cache, tmp_path):
    best, other = plans
    assert best.devices == "own" and best.reached and best.success > 0.5
    assert not other.reached and other.failures[0]["ends"] == "passes" and other.failures[0]["branch"] == "trunk"
    assert best.tip_mm.shape == (len(best.seconds), 3) and best.wall_force_N.dtype == np.float64
    assert best.distance_mm[-1] < 15 and best.distance_mm.min() < 5
    assert {row["of"] for row in best.sensitivities} >= {"EI of the wire", "amounts of pushes"}
    # Played line by line through the module, it completes.
    file = tmp_path / "best.toml"
    file.write_text(best.scenario)
    sim = sd.Simulation(str(file), cache=cache)
    lines = [line.split(maxsplit=1) for line in best.course.splitlines() if line and not line.startswith("#")]
    frames = {}
    for when, what in lines:
        first, _, last = when.partition("..")
        for frame in range(int(first), int(last or first) + 1):
            frames.setdefault(frame, []).append(what)
    state = sim.state
    for frame in range(max(frames)):
        for what in frames.get(frame, []):
            sim.apply(what)
        state = sim.step()
        assert np.allclose(state.tip_mm, best.tip_mm[frame], atol=1e-9)
    assert state.completed


def test_the_same_seed_gives_the_plan_of_the_program(plans, program, cache, tmp_path):
    again = sd.plan(FORK, frames=3000, threads=1, cache=cache)
    assert again[0].course == plans[0].course
    file = tmp_path / "fork.toml"
    file.write_text(plans[0].scenario)
    subprocess.run([program, "plan", str(file), "--frames", "3000", "--out", str(tmp_path / "out"), "--cache", str(cache)],
                   check=True, capture_output=True)
    assert (tmp_path / "out" / "best.gw").read_text() == plans[0].course


def test_threads_run_meanwhile(cache):
    ticks, done = [], threading.Event()

    def count():
        while not done.wait(0.005):
            ticks.append(1)

    other = threading.Thread(target=count)
    other.start()
    sd.plan(FORK, devices="glidestraight035", frames=1000, cache=cache)
    done.set()
    other.join()
    assert ticks


@pytest.mark.parametrize("wrong, said", [
    ({"devices": "cobra5f"}, "expected a wire first"),
    ({"devices": ""}, "found nothing"),
    ({"devices": None}, "expected a text"),
    ({"exchange": "cobra5f"}, "expected wires, found 'cobra5f'"),
    ({"exchange": 1}, "expected a text"),
    ({"to": "nowhere"}, "expected a target or a branch"),
    ({"from_": "nowhere"}, "expected an open end"),
    ({"patient": "seed:17"}, "has one patient"),
    ({"threads": 0}, "expected a whole number from 1 to 256"),
    ({"threads": True}, "expected a whole number"),
    ({"frames": 10}, "expected a whole number from 1000"),
    ({"seed": -1}, "expected a whole number from 0"),
    ({"time_limit_s": float("nan")}, "expected a time above 0"),
])
def test_what_is_wrong_is_said(wrong, said, cache):
    with pytest.raises(sd.InputError, match=said):
        sd.plan(FORK, cache=cache, **wrong)


def test_a_time_limit_marks_what_it_has_cut_short(cache):
    made = sd.plan(FORK, devices="glidestraight035", time_limit_s=1e-3, cache=cache)
    assert made[0].about["stopped"] and not made[0].reached


def test_a_wire_is_exchanged_where_that_leads_on(cache):
    made = sd.plan(FORK, devices="glidestraight035+guide6f", exchange="glide035", frames=12_000, cache=cache)
    assert made[0].reached and made[0].about["exchanges"] == 1 and "exchange wire glide035" in made[0].course
    alone = sd.plan(FORK, exchange="jwire035", frames=1000, cache=cache)
    assert alone[0].about["exchanges"] == 0 and "nothing lies around it" in alone[0].about["not_tried"][0]
