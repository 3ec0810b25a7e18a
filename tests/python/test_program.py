"""What the program offers to other languages: serve, bake, run --commands -."""

import json
import os
import resource
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

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


def test_a_served_exercise_goes_back_to_what_was_kept(served):
    served.ask("advance 3 mm", "step")
    number = served.ask("keep")["kept"]
    first = [served.ask("advance 1 mm", "step")["hash"] for _ in range(3)]
    assert served.ask(f"back {number}")["frame"] == 0
    assert [served.ask("advance 1 mm", "step")["hash"] for _ in range(3)] == first
    assert served.ask("restart")["hash"] == served.first["hash"]
    assert served.end() == (0, "")


def test_many_frames_are_one_step_and_every_line_fits_the_schema(program, cache, served, tmp_path):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(subprocess.run([program, "serve", "s_bend", "--schema"], check=True, capture_output=True).stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    fits = jsonschema.Draft202012Validator(schema).validate
    fits(served.first)
    lines = [served.ask("advance 3 mm", "rotate 20 deg", "step") for _ in range(1)]
    lines += [served.ask("step") for _ in range(6)]
    at = served.ask("restart")
    assert at["hash"] == served.first["hash"]
    jumped = served.ask("advance 3 mm", "rotate 20 deg", "step 7")
    assert (jumped["hash"], jumped["frame"]) == (lines[-1]["hash"], 6)
    for answer in lines + [jumped, served.ask("keep"), served.ask("score"), served.ask("fly"), served.ask("step 0"),
                           served.ask("step x"), served.ask("step 2 3"), served.ask(f"image 64 {tmp_path}/a.png"),
                           served.ask(f"save {tmp_path}/a.gw")]:
        fits(answer)
    for line in ("step 0", "step -1", "step 1.5", "step x", "step 2 3", "step 100001"):
        assert "from 1 to 100000" in served.ask(line)["error"]
    with pytest.raises(jsonschema.ValidationError):
        fits({**jumped, "hash": 3})
    with pytest.raises(jsonschema.ValidationError):
        fits({**jumped, "unknown": 3})
    two = Served(program, cache, "carotid_vertebral")
    fits(two.first)
    fits(two.ask("advance all 3 mm", "step 2"))
    two.process.kill()
    two.process.wait()


def test_the_client_in_c_reaches_the_target(program, cache, tmp_path):
    compiler = shutil.which("cc")
    if not compiler:
        pytest.skip("no C compiler")
    source = Path(__file__).resolve().parents[2] / "examples" / "serve_client.c"
    client = tmp_path / "serve_client"
    subprocess.run([compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", "-o", client, source], check=True)
    played = subprocess.run([client, program, "straight"], capture_output=True, text=True, timeout=120,
                            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)})
    assert played.returncode == 0, played.stderr
    assert played.stdout.endswith("target reached\n")


def test_served_errors_are_answered_and_change_nothing(served):
    before = served.ask("step")["hash"]
    for line, says in (("fly", "fly"), ("arm lao 300 deg", "-120 to 120"), ("back 7", "below 0"), ("image 64", "FILE.png"),
                       ("image 8 /tmp/x.png", "32 to 2048"), ("save", "the name of a file"),
                       ("advance catheter 1 mm", "the scenario has none")):
        assert says in served.ask(line)["error"], line
    assert served.ask("state")["hash"] == before


@pytest.mark.parametrize("line", ["state x", "restart now", "keep 2", "score all", "quit 1"])
def test_words_after_a_line_that_takes_none_are_refused(served, line):
    before = served.ask("state")
    word, rest = line.split(" ")
    assert served.ask(line)["error"] == f"'{line}': expected '{word}' alone, found '{rest}' after it"
    assert served.ask("state") == before


def test_ten_thousand_commands_take_ten_times_as_long_as_a_thousand(program, cache):
    # In processor time, start and end apart; twice that is left for what else differs.
    def spent(commands):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        lines = "".join(f"arm lao {k % 90} deg\n" for k in range(commands)) + "step\n"
        ended = subprocess.run([program, "serve", "s_bend", "--cache", cache], input=lines, capture_output=True, text=True)
        assert ended.stdout.count("\n") == 2 and '"error"' not in ended.stdout
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    none, some, many = (min(spent(n) for _ in range(3)) for n in (0, 4000, 40_000))
    assert many - none < 20 * max(some - none, 0.01)


def test_commands_asked_for_one_by_one_are_judged_as_a_script_is(served, bend):
    # A move of the C-arm that is fine alone, and not after another one.
    for line in ("arm sid 900 mm", "arm sod 800 mm"):
        served.tell(line)
        bend.apply(line)
    said = served.ask("arm sid 700 mm")["error"]
    with pytest.raises(sd.InputError) as error:
        bend.apply("arm sid 700 mm")
    assert said == str(error.value)
    np.testing.assert_array_equal(bend.camera_matrix(), bend.camera_matrix())
    assert int(served.ask("step")["hash"], 16) == bend.step().hash


def test_a_line_that_is_too_long_is_told_and_not_kept(served):
    def peak_kB():
        with open(f"/proc/{served.process.pid}/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))

    before = served.ask("state")
    peak = peak_kB()
    error = served.ask("0" * 1_000_001)["error"]
    assert error == "expected a line of at most 1000000 bytes, found a longer one"
    served.process.stdin.write("0" * 100_000_000)  # the answer comes before the end of the line
    served.process.stdin.flush()
    assert json.loads(served.process.stdout.readline())["error"] == error
    served.tell("")
    assert served.ask("state") == before
    assert peak_kB() - peak < 20_000
    assert "'000" in served.ask("0" * 1_000_000)["error"]


def test_so_many_states_are_kept_and_no_more(program, cache):
    served = Served(program, cache, "s_bend", "--keep", "3")
    try:
        assert [served.ask("keep")["kept"] for _ in range(3)] == [0, 1, 2]
        assert "at most 3 kept states" in served.ask("keep")["error"] and "--keep" in served.ask("keep")["error"]
        assert served.ask("back 2")["frame"] == -1
    finally:
        served.process.kill()
        served.process.wait()
    for wrong in ("0", "1.5", "many"):
        assert subprocess.run([program, "serve", "s_bend", "--keep", wrong], capture_output=True).returncode == 2


def own_scenario(folder):
    """A scenario in a folder of its own, and other names of its file."""
    scenario = folder / "own.toml"
    scenario.write_bytes((sd.assets() / "scenarios" / "s_bend.toml").read_bytes())
    (folder / "sub").mkdir()
    (folder / "link.png").symlink_to(scenario)
    os.link(scenario, folder / "hard.gw")
    return scenario, [scenario, folder / "link.png", folder / "hard.gw", folder / "sub" / ".." / "own.toml"]


def test_the_file_of_a_wire_that_was_exchanged_is_not_overwritten(cache, tmp_path):
    scenario, wire = tmp_path / "own.toml", tmp_path / "wire.toml"
    scenario.write_bytes((sd.assets() / "scenarios" / "renal_cobra.toml").read_bytes())
    wire.write_bytes((sd.assets() / "devices" / "glide035.toml").read_bytes())
    with sd.Simulation(scenario, cache=cache) as sim:
        sim.apply("remove wire")
        sim.step(frames=60)
        sim.apply("exchange wire wire.toml")
        sim.step()
        sim.reset()
        with pytest.raises(sd.InputError, match="would overwrite what is read"):
            sim.save(wire)
    assert wire.read_bytes() == (sd.assets() / "devices" / "glide035.toml").read_bytes()


def test_what_is_read_is_never_overwritten_by_serve_or_by_the_module(program, cache, tmp_path, monkeypatch):
    # A catalogue of its own: where the promise is broken, no file of the source is lost.
    shutil.copytree(sd.assets(), tmp_path / "assets")
    monkeypatch.setenv("SELDINGER_ASSETS", str(tmp_path / "assets"))
    scenario, inputs = own_scenario(tmp_path)
    script = tmp_path / "lines.txt"
    shipped = [sd.assets() / "devices" / "glide035.toml"]
    before = {path: path.read_bytes() for path in [*inputs, *shipped]}
    lines = [f"image 64 {path}" for path in [*inputs, *shipped, script]] + [f"save {path}" for path in [*inputs, *shipped, script]]
    script.write_text("\n".join(lines) + f"\nsave {tmp_path}/out.gw\nimage 64 {tmp_path}/out.png\n" * 2)
    with open(script) as stdin:
        ended = subprocess.run([program, "serve", scenario, "--cache", cache], stdin=stdin, capture_output=True, text=True)
    said = [json.loads(line) for line in ended.stdout.splitlines()[1:]]
    for line, answer in zip(lines, said):
        assert "would overwrite what is read" in answer.get("error", ""), (line, answer)
    assert [list(answer) for answer in said[len(lines):]] == [["saved"], ["image"]] * 2
    assert script.read_text().startswith(lines[0])
    with sd.Simulation(scenario, cache=cache) as sim, sd.VectorSimulation(sim, 2, threads=1) as many:
        for path in [*inputs, *shipped]:
            with pytest.raises(sd.InputError, match="would overwrite what is read"):
                sim.save(path)
            with pytest.raises(sd.InputError, match="would overwrite what is read"):
                many.save(1, path)
        sim.save(tmp_path / "out.gw")
    for path, text in before.items():
        assert path.read_bytes() == text


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


@pytest.mark.parametrize("arguments, says", [
    (("nowhere", "--seeds", "0:1"), "nowhere"), (("iliac-renal", "--seeds", "5"), "FIRST:END"),
    (("iliac-renal", "--seeds", "5:5"), "FIRST:END"), (("iliac-renal", "--seeds", "0:1x"), "FIRST:END")])
def test_bake_names_what_is_wrong(program, tmp_path, arguments, says):
    result = subprocess.run([program, "bake", *arguments, "--cache", tmp_path], capture_output=True, text=True)
    assert result.returncode == 2 and says in result.stderr
    assert not list(tmp_path.iterdir())


def test_serve_waits_for_a_reader_who_is_slow_and_ends_at_a_signal_meanwhile(program, cache):
    serve = subprocess.Popen([program, "serve", "straight", "--cache", str(cache)], stdin=subprocess.PIPE,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    asked = [0]

    def ask():
        try:
            while True:
                serve.stdin.write(b"state\n" * 100)
                serve.stdin.flush()
                asked[0] += 100
        except (BrokenPipeError, ValueError):
            pass

    threading.Thread(target=ask, daemon=True).start()
    assert serve.stdout.readline().startswith(b"{")
    before = -1
    while asked[0] != before:  # until both pipes are full
        before = asked[0]
        time.sleep(0.3)
    assert asked[0] < 100_000
    serve.send_signal(signal.SIGTERM)
    assert serve.wait(60) == 130
    assert serve.stderr.read() == b""
