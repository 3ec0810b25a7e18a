"""Objects before they are made, and threads when Python ends."""

import subprocess
import sys

import numpy as np
import pytest

import seldinger as sd
from seldinger import _core


def run(text, *arguments):
    return subprocess.run([sys.executable, "-c", text, *arguments], capture_output=True, text=True, timeout=300)


def unmade_simulations():
    for one in (sd.Simulation, _core.Simulation):
        yield one.__new__(one)


def unmade_vectors():
    for several in (sd.VectorSimulation, _core.VectorSimulation):
        yield several.__new__(several)


def public(thing):
    return [name for name in dir(type(thing)) if not name.startswith("__")]


@pytest.mark.parametrize("thing", [*unmade_simulations(), *unmade_vectors()])
def test_every_member_of_an_object_before_its_init_raises_an_error(bend, thing):
    given = {"apply": ["beam on"], "restore": [bend.snapshot()], "project": [[[0, 0, 0]]], "save": ["x.gw"],
             "path_from": [[0, 0, 0]], "step": [np.zeros((1, 1, 2))], "route": [3, 1.0], "assign": [0, bend], "aim": [0, "LRA"],
             "images": [64], "masks": [64], "image": [64]}
    of_many = isinstance(thing, _core.VectorSimulation)
    if of_many:
        given["_assign"] = given["assign"]
        for name in ("apply", "restore", "save", "path_from", "branch_name", "_score", "score", "snapshot", "panel", "show_tip",
                     "_target"):
            given[name] = [0, *given.get(name, [])]
    else:
        given["step"] = [1.0]
    tried = 0
    for name in public(thing):
        if name in ("_open", "_open_like", "_arguments", "close"):
            continue
        with pytest.raises((sd.InputError, AttributeError)):
            value = getattr(thing, name)
            if callable(value):
                value(*given.get(name, []))
        tried += 1
    assert tried > 15 and "Simulation" in repr(thing)
    if of_many:
        with pytest.raises(sd.InputError, match="__init__"):
            len(thing)
    thing.close()  # of what was never made nothing is left


@pytest.mark.parametrize("make", [lambda: _core.State.__new__(_core.State), lambda: _core.Snapshot.__new__(_core.Snapshot),
                                  _core.State, _core.Snapshot, lambda: _core.State.__new__(_core.State).wire_mm,
                                  lambda: _core.Simulation.__new__(int)])
def test_states_and_snapshots_come_from_simulations_alone(make):
    with pytest.raises(TypeError):
        make()


def test_a_class_that_reads_its_state_too_early_is_told(cache):
    class Early(sd.Simulation):
        def __init__(self):
            self.start = self.state
            super().__init__("s_bend", cache=cache)

    class Never(sd.Simulation):
        def __init__(self):
            pass

    class Twice(sd.Simulation):
        def __init__(self):
            super().__init__("s_bend", cache=cache)
            super().__init__("s_bend", cache=cache)

    with pytest.raises(sd.InputError, match=r"super\(\).__init__\(\) first"):
        Early()
    with pytest.raises(sd.InputError, match=r"super\(\).__init__\(\) first"):
        Never().step()
    with pytest.raises(sd.InputError, match="expected one call"):
        Twice()


def test_simulations_that_could_not_be_made_say_so(cache):
    sim = sd.Simulation.__new__(sd.Simulation)
    with pytest.raises(sd.InputError, match="no such scenario"):
        sim.__init__("kidney")
    with pytest.raises(sd.InputError, match="__init__"):
        sim.step()
    sim.__init__("s_bend", cache=cache)
    assert sim.step().frame == 0 and not sim.closed


DAEMON = """
import sys, threading, time
import numpy as np
import seldinger as sd
what, cache = sys.argv[1:]
one = sd.Simulation("s_bend", cache=cache)
many = sd.VectorSimulation("s_bend", 4, threads=2, cache=cache)
work = {"step": lambda: one.step(0.01), "image": lambda: one.image(128), "vec": lambda: many.step(np.full((4, 1, 2), 0.01)),
        "new": lambda: sd.Simulation("s_bend", cache=cache), "state": lambda: one.state, "frames": lambda: one.step(frames=50)}
work["mixed"] = lambda: [call() for name, call in work.items() if name not in ("mixed", "frames")]
begun = threading.Semaphore(0)

def loop():
    while True:
        work[what]()
        begun.release()

for _ in range(3):
    threading.Thread(target=loop, daemon=True).start()
for _ in range(4):
    begun.acquire()
"""


@pytest.mark.parametrize("what", ["step", "image", "vec", "new", "state", "frames", "mixed"])
def test_python_ends_while_daemon_threads_work(cache, what):
    for _ in range(20):
        ended = run(DAEMON, what, str(cache))
        assert (ended.returncode, ended.stderr) == (0, "")


def test_what_is_freed_while_python_ends_is_freed(cache):
    ended = run("""
import sys, atexit
import seldinger as sd
class Last:
    def __init__(self):
        self.sim = sd.Simulation("s_bend", cache=sys.argv[1])
    def __del__(self):
        self.sim.step(1)
        self.sim.close()
        print("freed")
kept = Last()
""", str(cache))
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "freed\n", "")


def test_a_forked_process_ends_though_a_thread_of_its_parent_was_at_work(cache):
    ended = run(DAEMON.replace('"frames": lambda: one.step(frames=50)', '"frames": lambda: one.step(frames=2000)') + """
import os
for _ in range(5):
    child = os.fork()
    if child == 0:
        sys.exit(3)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 3
""", "step", str(cache))
    assert (ended.returncode, ended.stderr) == (0, "")
