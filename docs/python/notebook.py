#!/usr/bin/env python3
"""Runs docs/python/tour.ipynb and writes what its cells show: PYTHONPATH=build/python /usr/bin/python3 docs/python/notebook.py

Nothing but Python itself is needed. A cell shows what it prints, and its last line where that is a value, as Jupyter does."""

import ast
import base64
import contextlib
import io
import json
from pathlib import Path

FILE = Path(__file__).with_name("tour.ipynb")


def shown(value):
    """The output of a value: its picture where it has one, and its text."""
    data = {"text/plain": repr(value).splitlines(keepends=True)}
    if hasattr(value, "_repr_png_"):
        data["image/png"] = base64.b64encode(value._repr_png_()).decode()
    return {"output_type": "execute_result", "execution_count": None, "metadata": {}, "data": data}


def outputs_of(source, names):
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    outputs = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)})
    if value is not None:
        outputs.append(shown(value))
    return outputs


def run(notebook):
    """The notebook with the outputs of all its cells."""
    names = {"__name__": "__main__"}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            cell["outputs"] = outputs_of("".join(cell["source"]), names)
    return notebook


if __name__ == "__main__":
    FILE.write_text(json.dumps(run(json.loads(FILE.read_text())), indent=1, ensure_ascii=False) + "\n")
