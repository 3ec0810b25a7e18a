#!/usr/bin/env python3
"""What follows from the engine's table of fields (engine/exercise/observation.cpp): the attributes in the module's stubs, put
into build/python by the build, and the table in docs/python.md.

    PYTHONPATH=build/python /usr/bin/python3 app/python/fields.py --stubs build/python/seldinger/_core.pyi
    PYTHONPATH=build/python /usr/bin/python3 app/python/fields.py --docs docs/python.md
"""

import argparse
import re
import sys
from pathlib import Path

# Not this folder's package, which lacks the built module.
sys.path = [path for path in sys.path if Path(path).resolve() != Path(__file__).resolve().parent]
from seldinger import _core  # noqa: E402

TYPES = {"int": "int", "float": "float", "bool": "bool", "str": "str"}
BEGIN, END = "<!-- fields: app/python/fields.py -->\n", "<!-- end of fields -->\n"


def attributes():
    """Names and types of State, those of the catheter among them."""
    for name, _, kind, arrays, _, _ in _core._FIELDS:
        if name:
            yield name, TYPES.get(kind, "NDArray[np.float64]")
            if arrays.startswith("(n, devices)"):
                for device in _core._DEVICES[1:]:
                    yield f"{device}_{name}", "float"


def arrays():
    """Names and types of the arrays of VectorSimulation."""
    for name, _, _, shape, _, _ in _core._FIELDS:
        if name and shape:
            number = shape.split()[-1]
            yield name, f"NDArray[np.{'bool_' if number == 'bool' else number}]"
    for name in ("track_mm", "track_px", "tracks_mm", "tracks_px", "c_arm_deg", "table_mm"):
        yield name, "NDArray[np.float64]"
    yield "readings", "NDArray[np.void]"


def stubs(text):
    """The stubs with attributes in place of the two lines that stand for them."""
    for line, members in (("    ...  # attributes: app/python/fields.py\n", attributes()),
                          ("    ...  # arrays: app/python/fields.py\n", arrays())):
        made = "".join(f"    @property\n    def {name}(self) -> {kind}: ...\n" for name, kind in members)
        text = text.replace(line, made)
    return text


def table():
    """The table of docs/python.md."""
    lines = ["| State, `serve`, arrays | column of a trace | unit | what it is |", "| --- | --- | --- | --- |"]
    for name, column, kind, shape, unit, doc in _core._FIELDS:
        both = ", `catheter_…`" if shape.startswith("(n, devices)") else ""
        shown = f"`{name}`{both}: {kind}" if name else ""
        lines.append(f"| {shown} | {f'`{column}`' if column else ''} | {unit} | {doc} |")
    return "\n".join(lines) + "\n"


def documented(text):
    """The page with the table of now."""
    return re.sub(re.escape(BEGIN) + ".*?" + re.escape(END), lambda _: BEGIN + table() + END, text, flags=re.S)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stubs", type=Path)
    parser.add_argument("--docs", type=Path)
    options = parser.parse_args()
    for file, change in ((options.stubs, stubs), (options.docs, documented)):
        if file:
            file.write_text(change(file.read_text()))


if __name__ == "__main__":
    main()
