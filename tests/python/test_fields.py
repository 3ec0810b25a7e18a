"""Everything that follows from the engine's one table of fields says the same: State, arrays, lines, traces, stubs, docs."""

import ast
import csv
import importlib.util
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import seldinger as sd
from seldinger import _core

SOURCE = Path(__file__).resolve().parents[2]


def maker():
    spec = importlib.util.spec_from_file_location("fields", SOURCE / "app" / "python" / "fields.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def members(name):
    """Names of a class in the stubs that were built."""
    tree = ast.parse((Path(_core.__file__).parent / "_core.pyi").read_text())
    return {node.name for one in tree.body if isinstance(one, ast.ClassDef) and one.name == name
            for node in one.body if isinstance(node, ast.FunctionDef)}


def test_the_table_in_the_docs_is_that_of_the_engine():
    page = (SOURCE / "docs" / "python.md").read_text()
    made = maker()
    assert made.table() in page
    assert made.documented(page) == page, "run app/python/fields.py --docs docs/python.md"


def test_stubs_states_and_lines_have_the_fields_of_the_table(cobra):
    state = cobra.step(advance_mm=1, catheter_advance_mm=1)
    names = [name for name, _ in maker().attributes()]
    assert len(names) == len(set(names)) > 40
    assert set(names) == {name for name in dir(state) if not name.startswith("_") and name != "asdict"} \
        == members("State") - {"asdict"}
    for name in names:
        assert getattr(_core.State, name).__doc__.endswith((".", "]")), name


@pytest.mark.parametrize("scenario", ["s_bend", "renal_cobra"])
def test_states_records_lines_and_traces_hold_the_same_numbers(program, cache, tmp_path, scenario):
    rng = np.random.default_rng(11)
    script = []
    with sd.Simulation(scenario, cache=cache) as one, sd.VectorSimulation(one, 2, threads=1) as many:
        devices, by, device_names = (one.about()[key] for key in ("devices", "target_by", "device_names"))
        served = subprocess.Popen([program, "serve", scenario, "--cache", str(cache)], stdin=subprocess.PIPE,
                                  stdout=subprocess.PIPE, text=True)
        lines, states, records = [json.loads(served.stdout.readline())], [one.state], [many.readings[1].copy()]
        for frame in range(40):
            mm, deg = np.round(rng.uniform(-1, 3, devices), 3), np.round(rng.uniform(-20, 20, devices), 3)
            for device, feed, turn in zip(("", " catheter"), mm, deg):
                commands = [f"{'advance' if feed >= 0 else 'withdraw'}{device} {abs(feed)} mm", f"rotate{device} {turn} deg"]
                script += [f"{frame} {command}" for command in commands]
                served.stdin.write("".join(command + "\n" for command in commands))
                for command in commands:
                    one.apply(command)
                    many.apply(1, command)
            served.stdin.write("step\n")
            served.stdin.flush()
            lines.append(json.loads(served.stdout.readline()))
            states.append(one.step())
            many.step(np.zeros((2, 1, 2)))
            records.append(many.readings[1].copy())
        served.stdin.close()
        served.wait()
        names = [branch["name"] for branch in one.anatomy()["branches"]]
    compared = estimated = 0
    for line, state, record in zip(lines, states, records):
        assert set(line) == set(state.asdict())
        for name, value in line.items():
            there = getattr(state, name)
            there = f"{there:016x}" if name == "hash" else there.tolist() if isinstance(there, np.ndarray) else there
            assert value == (None if there != there else there), name
        for name in record.dtype.names:
            there = getattr(state, name)
            if name in ("tip_error_mm", "wall_force_error_N", "tip_error_wall_mm", "tip_error_vessels_mm",
                        "tip_error_twist_mm"):
                assert np.isnan(record[name]), "arrays do not pay for an estimate"
                estimated += there == there
                continue
            if hasattr(state, "catheter_" + name):
                there = [there] + [getattr(state, f"{device}_{name}") for device in device_names[1:]]
                there += [0] * (len(_core._DEVICES) - len(there))
            if name == "branch":
                there = names.index(there)
            np.testing.assert_array_equal(record[name], there, err_msg=name)
            compared += 1
    assert compared > 41 * 30 and estimated > 41
    # A trace of the same commands: its columns that have a field of State.
    (tmp_path / "course.gw").write_text("\n".join(script) + "\n39 end\n")
    subprocess.run([program, "run", scenario, "--commands", tmp_path / "course.gw", "--trace", tmp_path / "trace.csv",
                    "--out", tmp_path / "out", "--frames", "none", "--cache", cache], capture_output=True)
    rows = list(csv.DictReader(open(tmp_path / "trace.csv")))
    columns = [column.replace("?", axis) for _, column, *_ in _core._FIELDS if column
               for axis in ("xyz" if "?" in column else "x")]
    assert list(rows[0]) == columns and len(rows) == 40 * devices
    about_catheter = by == "catheter"
    for k, row in enumerate(rows):
        state, catheter = states[1 + k // devices], row["device"] == "catheter"
        for name, column, kind, shape, _, _ in _core._FIELDS:
            if not name or not column or "?" in column or name == "air_kerma_mGy":
                continue
            if name.endswith("_mmHg") and not row[column]:
                absent = getattr(state, name)
                assert absent != absent if name == "gradient_mmHg" else absent == 0
                continue
            of_device = kind == "float" and shape.startswith("(n, devices)")
            if not of_device and name not in ("time_s", "settling") and catheter != about_catheter:
                continue  # of the device that the exercise is about
            there = getattr(state, ("catheter_" if catheter and of_device else "") + name)
            cell = row[column]
            assert (cell == there if isinstance(there, str) else float(cell or "nan") == there or there != there), column
