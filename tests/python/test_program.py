"""What the program offers to other languages: serve, bake, run --commands -."""

import json
import os
import subprocess

import numpy as np
import pytest

import seldinger as sd


class Served:
    def __init__(self, program, cache, *arguments):
        self.process = subprocess.Popen([program, "serve", *arguments, "--cache", str(cache)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.first = json.loads(self.process.stdout.readline())

    def tell(self, *lines):
        self.process.stdin.write("".join(line + "\n" for line in lines))
        self.process.stdin.flush()

    def ask(self, *lines):
        self.tell(*lines)
        return json.loads(self.process.stdout.readline())

    def end(self):
        self.process.stdin.close()
        return self.process.wait(timeout=60), self.process.stdout.read()


@pytest.fixture
def served(program, cache):
    one = Served(program, cache, "s_bend")
    yield one
    one.process.kill()
    one.process.wait()


def test_a_served_exercise_makes_the_same_states_as_the_module(served, bend):
    assert served.first["frame"] == -1 and int(served.first["hash"], 16) == bend.state.hash
    for _ in range(5):
        line = served.ask("advance 2 mm", "rotate 10 deg", "step")
        state = bend.step(advance_mm=2, rotate_deg=10)
        assert int(line["hash"], 16) == state.hash
        assert line["tip_mm"] == state.tip_mm.tolist() and line["wire_px"] == state.wire_px.tolist()
        assert line["push_N"] == state.push_N and line["path_to_target_mm"] == state.path_to_target_mm
        assert line["joint_force_N"] == state.joint_force_N.tolist()
    assert set(line) == {name for name in dir(state) if not name.startswith("_")}
    assert served.end() == (0, "")


def test_a_served_catheter_is_that_of_the_module(program, cache, cobra):
    served = Served(program, cache, "renal_cobra")
    try:
        line = served.ask("advance catheter 2 mm", "step")
        state = cobra.step(catheter_advance_mm=2)
        for name, value in line.items():
            there = getattr(state, name)
            assert (int(value, 16) if name == "hash" else value) == (there.tolist() if isinstance(there, np.ndarray) else there)
    finally:
        served.process.kill()
        served.process.wait()


def test_a_served_exercise_goes_back_to_what_was_kept(served):
    served.ask("advance 3 mm", "step")
    number = served.ask("keep")["kept"]
    first = [served.ask("advance 1 mm", "step")["hash"] for _ in range(3)]
    assert served.ask(f"back {number}")["frame"] == 0
    assert [served.ask("advance 1 mm", "step")["hash"] for _ in range(3)] == first
    assert served.ask("restart")["hash"] == served.first["hash"]


def test_served_errors_are_answered_and_change_nothing(served):
    before = served.ask("step")["hash"]
    for line, says in (("fly", "fly"), ("arm lao 300 deg", "-120 to 120"), ("back 7", "below 0"), ("image 64", "FILE.png"),
                       ("image 8 /tmp/x.png", "32 to 2048"), ("save", "the name of a file"),
                       ("advance catheter 1 mm", "the scenario has none")):
        assert says in served.ask(line)["error"], line
    assert served.ask("state")["hash"] == before


def test_served_images_recordings_and_scores_are_those_of_the_module(served, bend, tmp_path):
    served.ask("advance 2 mm", "step")
    bend.step(advance_mm=2)
    assert served.ask(f"image 64 {tmp_path}/served.png") == {"image": f"{tmp_path}/served.png"}
    sd.write_png(tmp_path / "module.png", bend.image(64))
    assert (tmp_path / "served.png").read_bytes() == (tmp_path / "module.png").read_bytes()
    served.ask(f"save {tmp_path}/served.gw")
    bend.save(tmp_path / "module.gw")
    same = [[line for line in open(tmp_path / name) if not line.startswith("program")]
            for name in ("served.gw", "module.gw")]
    assert same[0] == same[1]
    assert served.ask("score")["wire_travel_mm"] == bend.score()["wire_travel_mm"]


def test_commands_may_come_from_standard_input(program, cache, tmp_path, bend):
    result = subprocess.run([program, "run", "s_bend", "--commands", "-", "--out", tmp_path / "out", "--frames", "none",
                             "--cache", cache], input="0..4 advance 2 mm\n4 end\n", capture_output=True, text=True)
    assert result.returncode in (0, 1), result.stderr
    for _ in range(5):
        state = bend.step(advance_mm=2)
    assert f"state 4 {state.hash:016x}" in (tmp_path / "out" / "run.gw").read_text()


def test_baked_anatomies_are_those_that_simulations_take(program, tmp_path):
    """Whatever is made anew is put in its place by a rename, so that the place then has another inode."""
    def bake():
        result = subprocess.run([program, "bake", "iliac-renal", "--seeds", "0:3", "--cache", tmp_path],
                                capture_output=True, text=True)
        assert result.returncode == 0 and "3 of 3" in result.stdout, result.stderr

    def kept():
        return {str(path.relative_to(tmp_path)): path.stat().st_ino for path in tmp_path.rglob("*") if path.is_file()}
    bake()
    made = kept()
    for kind in ("anatomy-", "field-", "body-"):
        assert len({name.split("/")[0] for name in made if name.startswith(kind)}) == 3
    for seed in range(3):
        with sd.Simulation("renal", set={"anatomy.seed": seed}, cache=tmp_path) as sim:
            assert sim.image(64).shape == (64, 64)
        assert kept() == made, seed
    bake()
    assert kept() == made


@pytest.mark.parametrize("arguments, says", [
    (("nowhere", "--seeds", "0:1"), "nowhere"), (("iliac-renal", "--seeds", "5"), "FIRST:END"),
    (("iliac-renal", "--seeds", "5:5"), "FIRST:END"), (("iliac-renal", "--seeds", "0:1x"), "FIRST:END")])
def test_bake_names_what_is_wrong(program, tmp_path, arguments, says):
    result = subprocess.run([program, "bake", *arguments, "--cache", tmp_path], capture_output=True, text=True)
    assert result.returncode == 2 and says in result.stderr
    assert not list(tmp_path.iterdir())
