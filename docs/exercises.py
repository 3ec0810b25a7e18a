#!/usr/bin/env python3
"""Writes docs/exercises: a page for each exercise that ships, an index and the page of errors. All text comes from the
exercise's own files: assets/scenarios/NAME.toml, NAME.png and benchmark.toml, assets/scripts/NAME.gw, assets/devices, the
tables of errors and points in engine/exercise, and docs/exercises/ways.json, which docs/exercises_ways.py makes.

    docs/exercises.py            # write the pages
    docs/exercises.py --check    # write nothing; exit code 1 if a page is out of date

It needs Python 3.11 and nothing else.
"""

import argparse
import json
import re
import statistics
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCENARIOS, SCRIPTS, DEVICES = ROOT / "assets/scenarios", ROOT / "assets/scripts", ROOT / "assets/devices"
PAGES = ROOT / "docs/exercises"
MARK = "<!-- Made by docs/exercises.py. Edit the exercise's own files instead. -->\n\n"
LEVELS = {1: "wire and pedals", 2: "one decision", 3: "catheters, limits and longer ways", 4: "small and moving vessels"}
# Of each line of the grade its key in benchmark.toml, and the digits that are shown.
MEASURES = {"time": ("completed_after_s", 1), "air_kerma": ("air_kerma_mGy", 1),
            "area_product": ("kerma_area_product_Gy_cm2", 2), "contrast": ("contrast_ml", 1),
            "travel": ("wire_travel_mm", 0), "wrong_branches": ("wrong_entries", 0), "errors": ("handling_errors", 0)}
ORDER = ("guidewire", "microcatheter", "intermediate", "balloon", "catheter", "sheath")
CHANGES = {"tip_length_mm": "floppy over {} mm", "curved_length_mm": "bent over its last {} mm", "curved_angle_deg": "by {}°",
           "roll_deg": "turned by {}° at the start"}


def load(path):
    with open(path, "rb") as file:
        return tomllib.load(file)


def plain(number):
    return f"{number:g}"


def strings(array, source):
    """The string literals of a C++ array, adjacent ones joined."""
    body = re.search(array + r"\s*=\s*\{(.*?)\};", source, re.S).group(1)
    parts = re.findall(r'((?:"(?:[^"\\]|\\.)*"\s*)+)(?:,|$)', body.strip())
    return ["".join(re.findall(r'"((?:[^"\\]|\\.)*)"', part)) for part in parts]


def errors():
    source = (ROOT / "engine/exercise/handling.h").read_text()
    names = strings("handling_error_ids", source), strings("handling_error_texts", source), strings("handling_error_advice", source)
    if len({len(column) for column in names}) != 1:
        raise SystemExit("engine/exercise/handling.h: expected as many texts and advices as errors")
    return {name: (text, advice) for name, text, advice in zip(*names)}


def measures():
    """Of each line of the grade: its name, unit and the points that it costs at most."""
    source = (ROOT / "engine/exercise/grade.cpp").read_text()
    rows = re.findall(r'\{"(\w+)", "([^"]+)", "([^"]*)", \d, (\d+), ([\d.]+), &Benchmark', source)
    return {key: (name, unit, int(most)) for key, name, unit, most, _ in rows}


def vessel_names():
    source = (ROOT / "engine/anatomy/organs.cpp").read_text()
    tables = [dict(re.findall(r'\{"(\w+)", "([^"]+)"\}', re.search(name + r"\[\] = \{(.*?)\};", source, re.S).group(1)))
              for name in ("names", "sided")]
    return tables[0] | {side + short: f"{word} {whole}" for short, whole in tables[1].items()
                        for side, word in (("L", "left"), ("R", "right")) if side + short not in tables[0]}


NAMES = vessel_names()


def clinical(name):
    """The vessel's whole name behind its short one: of an end that of its own vessel."""
    branch, _, side = name.partition(".")
    parts = branch.split("+")
    shown = parts[:1] if side == "in" else parts[-1:] if side else dict.fromkeys((parts[0], parts[-1]))
    text = " to ".join(NAMES.get(part, part) for part in shown)
    return f"{text} (`{name}`)" if text != name else f"`{name}`"


def first_vessel(branch):
    part = branch.split("+")[0]
    return NAMES.get(part, part)


def listed(words):
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1]


def astray(way):
    """Where a tip can go astray: branches that leave the way, and mouths that the way turns into."""
    if way.get("passed"):
        names = listed(["the " + first_vessel(name) for name in way["passed"]])
        yield f"[Entering a wrong branch](errors.md#points) on the way: {names}"
    if way.get("turns"):
        mouths = listed(["the " + first_vessel(child) for _, child in way["turns"]])
        yield f"Going straight on past the mouth of {mouths}"


def limits_of_errors():
    source = re.search(r"struct HandlingErrorLimits \{(.*?)\};", (ROOT / "engine/exercise/handling.h").read_text(), re.S).group(1)
    return {key: float(value) for key, value in re.findall(r"double (\w+) = ([\d.]+);", source)}


LIMITS = limits_of_errors()
COUNTS = {
    "motion_without_beam": "a device moves while the beam is off",
    "beam_without_motion": f"the beam is on for more than {LIMITS['idle_beam']:g} s, nothing moves and no contrast runs",
    "push_against_resistance": f"{LIMITS['stuck_feed']:g} mm of a device are fed while its tip moves by less than a tenth of "
                               "that, or it is pushed against an end of the vessels",
    "force_over_limit": f"one joint presses the wall with more than {LIMITS['force']:g} N",
    "left_field_of_view": "a device moves while its tip is outside the open field",
    "target_lost": f"the tip was at the target and goes farther from its middle than {LIMITS['lost']:g} of its radii",
    "injection_at_wall": f"contrast leaves a catheter whose tip presses the wall with more than {LIMITS['tip_force']:g} N",
    "stale_roadmap": "a device moves under a roadmap that has no map of this view",
    "dissection": "the foremost end presses the wall with more than its layers bear",
    "perforation": "the foremost end presses the wall with more than the wall bears",
}


def captions(path):
    """The comments on lines of their own, one a paragraph, with the commands that follow each."""
    steps, text, commands = [], [], []
    for line in path.read_text().splitlines() + ["#"]:
        if line.startswith("#"):
            if commands:
                steps.append((" ".join(text), commands))
                text, commands = [], []
            text.append(line[1:].strip())
        elif line.strip():
            commands.append(re.sub(r"\s+#.*", "", line).rstrip())
        elif text and not commands:
            steps.append((" ".join(text), []))
            text = []
    return steps


def seconds(frame, rate):
    return f"{frame / rate:.1f} s"


def frames_of(command):
    first, _, last = command.split()[0].partition("..")
    return int(first), int(last or first)


def device_line(section, given):
    name = given.get("device", "glide035")
    kind = "wire" if section == "guidewire" else section
    title = load(DEVICES / f"{name}.toml")["title"]
    changed = [text.format(plain(given[key])) for key, text in CHANGES.items() if given.get(key)]
    return f"- **{kind[0].upper() + kind[1:]}**: {title} (`{name}`)" + (f"; here {', '.join(changed)}" if changed else "")


def view_text(view):
    lao, cranial = view.get("lao_deg", 0), view.get("cranial_deg", 0)
    side = "straight from the front" if not lao else f"{'LAO' if lao > 0 else 'RAO'} {plain(abs(lao))}°"
    tilt = "" if not cranial else f", {'cranial' if cranial > 0 else 'caudal'} {plain(abs(cranial))}°"
    return f"- {side}{tilt}: {view['shows']}"


def patient_text(one):
    return one.get("indication") or f"vessels of seed {one['seed']}"


def disease(anatomy):
    for stenosis in anatomy.get("stenosis", []):
        yield (f"a stenosis of {plain(stenosis['percent'])} % of the diameter, {plain(stenosis['length_mm'])} mm long, in "
               f"the {clinical(stenosis['branch'])}, {plain(stenosis['at_mm'])} mm along it")
    for wide in anatomy.get("fusiform_aneurysm", []):
        yield f"an aneurysm {plain(wide['diameter_mm'])} mm wide in the {clinical(wide['branch'])}"


def vessels_text(scenario):
    if "tube" in scenario:
        return f"a tube of {plain(2 * scenario['tube'].get('radius_mm', 2))} mm, without a patient"
    text = f"`{scenario['anatomy']['preset']}`, vessels of published dimensions"
    return "; ".join([text, *disease(scenario["anatomy"])])


def opened_text(target):
    """What a lesion must have become."""
    if "residual_percent" not in target:
        return ""
    return f"; the narrow place open to {plain(100 - target['residual_percent'])} % of the vessel or more, the balloon empty"


def target_text(target):
    device = target.get("device", "wire")
    where = f"the target in the {clinical(target['name'])}" if "name" in target else \
        "the place " + ", ".join(plain(x) for x in target["centre_mm"]) + " mm"
    return (f"the tip of the {device} within {plain(target.get('radius_mm', 3))} mm of {where}, "
            f"for {plain(target.get('hold_s', 0.5))} s")


def limits(scenario):
    if "time_limit_s" in scenario:
        yield f"{plain(scenario['time_limit_s'])} s of time"
    if "beam_limit_s" in scenario:
        yield f"{plain(scenario['beam_limit_s'])} s of beam"
    if "limit_ml" in scenario.get("contrast", {}):
        yield f"{plain(scenario['contrast']['limit_ml'])} ml of contrast"


def motion_text(motion):
    parts = []
    if "heart_reach_mm" in motion:
        parts.append(f"the heart beats {plain(motion.get('heart_rate_per_min', 70))} times a minute")
    if "breathing_reach_mm" in motion:
        parts.append(f"the patient breathes {plain(motion.get('breathing_rate_per_min', 15))} times a minute")
    return " and ".join(parts)


def figure(values, digits, unit):
    mean = statistics.fmean(values)
    spread = statistics.stdev(values) if len(values) > 1 else 0
    digits = digits if mean >= 1 or not mean else digits + 2
    shown = plain(mean) if spread == 0 else f"{mean:.{digits}f} ± {spread:.{digits}f}"
    return f"{shown} {unit}".strip()


def judged(name, benchmark):
    row = benchmark.get(name)
    if row is None:
        return ["It has no benchmark and no points."]
    lines = [f"A grade holds an attempt against {row['attempts']} attempts by {row['by']}.", "",
             "| figure | skilled: mean ± spread | costs at most |", "| --- | ---: | ---: |"]
    for key, (label, unit, most) in measures().items():
        values, digits = MEASURES[key]
        if values in row:
            lines.append(f"| {label} | {figure(row[values], digits, unit)} | {most} points |")
    lines += ["", "[How points are lost](errors.md#points) is the same for all exercises; 70 points pass."]
    if min(row.get("angiograms", [0])) >= 1:
        lines.append("All skilled attempts took an angiogram: an attempt without one loses the points for dose and contrast.")
    return lines


def to_avoid(scenario, script):
    target = scenario["target"]
    yield "motion_without_beam", ""
    yield "beam_without_motion", f"for more than {plain(LIMITS['idle_beam'])} s"
    yield "push_against_resistance", ""
    yield "left_field_of_view", ""
    yield "target_lost", f"by more than {plain(LIMITS['lost'] * target.get('radius_mm', 3))} mm from its middle"
    if "mode roadmap" in script:
        yield "stale_roadmap", ""
    if "through catheter" in script:
        yield "injection_at_wall", ""
    if "anatomy" in scenario:
        yield "dissection", ""
        yield "perforation", ""


def anchor(text):
    return re.sub(r"[^a-z0-9 -]", "", text.lower()).replace(" ", "-")


def solution(path, rate):
    lines = []
    for text, commands in captions(path):
        if not commands:
            lines += [text, ""]
            continue
        start, end = frames_of(commands[0])[0], max(frames_of(line)[1] for line in commands)
        lines += [f"**{seconds(start, rate)} to {seconds(end, rate)}.** {text}", "", "```text", *commands,
                  "```", ""]
    return lines


def page(name, benchmark, known, way):
    scenario = load(SCENARIOS / f"{name}.toml")
    lesson, rate = scenario.get("lesson", {}), scenario.get("frame_rate_hz", 15)
    script_path = SCRIPTS / f"{name}.gw"
    script = script_path.read_text()
    out = [f"# {scenario['title']}", "", f"`{name}`, level {lesson.get('level', '–')} of 4. {lesson.get('indication', '')}", "",
           f"![{name}, all vessels filled](../../assets/scenarios/{name}.png)", "",
           "*The vessels, filled with contrast, in the view the exercise begins with. The patient's right is on the left.*"
           if "anatomy" in scenario else "*The tube from the side.*", "", "    seldinger play " + name, "", "## Task", "",
           lesson.get("briefing", "").strip(), "",
           "| | |", "| --- | --- |", f"| vessels | {vessels_text(scenario)} |",
           f"| introducer | {clinical(scenario['entry']['end'])}, {plain(scenario['entry'].get('inserted_mm', 60))} mm of wire inside |",
           f"| reached | {target_text(scenario['target'])}{opened_text(scenario['target'])} |"]
    if found := list(limits(scenario)):
        out.append(f"| limits | {', '.join(found)} |")
    if moves := motion_text(scenario.get("motion", {})):
        out.append(f"| motion | {moves} |")
    out += ["", "## Devices", "", *(device_line(key, scenario[key]) for key in ORDER if key in scenario)]
    if steps := lesson.get("step"):
        out += ["", "## Steps", "", *(f"{i}. {step['text']} ({', '.join(f'`{a}`' for a in step.get('practise', []))})"
                                      for i, step in enumerate(steps, 1))]
    if views := lesson.get("view"):
        out += ["", "## Views", "", *map(view_text, views)]
    if hints := lesson.get("hints"):
        out += ["", "## Hints", "", *(f"- {hint}" for hint in hints)]
    if others := lesson.get("patient"):
        out += ["", "## Other patients", "", "The briefing offers them, and `--patient N`:", "",
                *(f"- `--patient {i}`: {patient_text(one)}" for i, one in enumerate(others, 2))]
    if steps:
        out += ["", "## How it is judged", "", "A guided lesson has no grade. You pass when every step is done and the target is "
                "reached."]
    else:
        out += ["", "## How it is judged", "", *judged(name, benchmark), "", "## Errors to avoid", ""]
        out += [f"- {error}" for error in astray(way)]
        for error, more in to_avoid(scenario, script):
            text = known[error][0]
            out.append(f"- [{text}](errors.md#{anchor(text)})" + (f" {more}" if more else ""))
    out += ["", "## Solution", "", "*Show me* in the briefing plays it. Without a window:", "",
            f"    seldinger run {name} --commands solution --out out/{name}", "", *solution(script_path, rate)]
    return MARK + "\n".join(out).rstrip() + "\n"


def index(names):
    out = ["# Exercises", "",
           f"{len(names)} exercises ship in four levels. `seldinger play` offers them; `seldinger play NAME` opens one.",
           "Levels open one after the other: the next opens when two thirds of a level are passed. "
           "`--open-all` opens all at once.", "",
           "The time is the mean of the attempts an exercise is graded by. These were played by a program, not by physicians.",
           "[Errors and points](errors.md) says what counts as an error, why, and how points are lost."]
    benchmark = load(SCENARIOS / "benchmark.toml")
    for level, what in LEVELS.items():
        here = [(name, t) for name, t in names.items() if t.get("lesson", {}).get("level") == level]
        out += ["", f"## Level {level}: {what}", "", "| | exercise | time | limits |", "| --- | --- | ---: | --- |"]
        times = {name: statistics.fmean(benchmark[name]["completed_after_s"]) if name in benchmark else 0 for name, _ in here}
        for name, scenario in sorted(here, key=lambda one: times[one[0]]):
            time = f"{times[name]:.0f} s" if times[name] else "–"
            out.append(f"| [![](../../assets/scenarios/{name}.png)]({name}.md) | [{scenario['title']}]({name}.md)<br>`{name}` "
                       f"| {time} | {', '.join(limits(scenario))} |")
    return MARK + "\n".join(out) + "\n"


def errors_page(known):
    grade = " ".join(strings_of_formula())
    out = ["# Errors and points", "",
           "An attempt has errors of two kinds: errors of handling, which the benchmark counts, and injuries of the wall, "
           "which cost points of their own. The end page and the debriefing list each one with its moment and place.", "",
           "## Errors of handling", ""]
    for key, (text, advice) in known.items():
        if key == "dissection":
            out += ["## Injuries", "", "[What the wall bears](../injury.md) is an estimate with its sources.", ""]
        out += [f"### {text}", "", f"It counts when {COUNTS[key]}. {advice} `score.json` calls it `{key}`.", ""]
    out += ["## Points", "", grade, "", "| figure | costs at most | why, and what to do |", "| --- | ---: | --- |"]
    source = (ROOT / "engine/exercise/grade.cpp").read_text()
    for key, (label, _, most) in measures().items():
        row = source[source.index(f'{{"{key}", '):]
        advice = "".join(re.findall(r'"((?:[^"\\]|\\.)*)"',
                                    re.search(r'(?:true|false),\s*((?:"(?:[^"\\]|\\.)*"\s*)+),', row).group(1)))
        out.append(f"| {label} | {most} points | {advice} |")
    return MARK + "\n".join(out) + "\n"


def strings_of_formula():
    source = (ROOT / "engine/exercise/grade.cpp").read_text()
    body = re.search(r"grade_formula\s*=\s*(.*?);\n", source, re.S).group(1)
    yield "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', body))


def pages():
    known = errors()
    names = {path.stem: load(path) for path in sorted(SCENARIOS.glob("*.toml"))}
    names = {name: scenario for name, scenario in names.items() if "entry" in scenario and "target" in scenario}
    benchmark = load(SCENARIOS / "benchmark.toml")
    ways = json.loads((PAGES / "ways.json").read_text())
    made = {f"{name}.md": page(name, benchmark, known, ways.get(name, {})) for name in names}
    return made | {"index.md": index(names), "errors.md": errors_page(known)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; say which pages are out of date")
    check = parser.parse_args().check
    made = pages()
    there = {path.name: path.read_text() for path in PAGES.glob("*.md")}
    wrong = [name for name in sorted(made.keys() | there.keys()) if made.get(name) != there.get(name)]
    if check:
        for name in wrong:
            print(f"docs/exercises/{name} is {'out of date' if name in made else 'of no exercise'}: run docs/exercises.py")
        return 1 if wrong else 0
    for name in wrong:
        (PAGES / name).unlink() if name not in made else (PAGES / name).write_text(made[name])
    print(f"docs/exercises: {len(made)} pages, {len(wrong)} changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
