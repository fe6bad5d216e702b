#!/usr/bin/env python3
"""Compare results with the references of this folder: check.py results/, or check.py FILE --problem NAME.

Needs numpy and nothing else. A folder of results holds, for each problem NAME, ``NAME.csv`` (samples: ``time`` and one
column for each angle and velocity, as ``angle.BODY``, ``velocity.BODY``), ``NAME.events.csv`` (``time``, ``element``,
``from_region``, ``to_region``) or both. Lines ``# rhs: 12345``, ``# seconds: 0.3`` at the top of a file are its cost.

Exit code 0: everything followed to the horizon. 1: something missed, invented or too far off. 2: unusable input.
"""

from __future__ import annotations

import argparse
import json
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

HOME = Path(__file__).resolve().parent / "problems"
FOLLOWED = 1e-3
"""Largest scaled error of a state that counts as followed."""
BATCHES = 20
STUDENT = 2.861
"""Student's t for 99 % and 19 degrees of freedom: half width of the confidence interval of a mean of 20 batches."""


class Unusable(Exception):
    """Input that cannot be used: file, value, rule, remedy."""


# Reading


def read_problem(name):
    """Return statement and reference of a problem."""
    folder = HOME / name
    if not (folder / "problem.json").is_file():
        known = ", ".join(sorted(path.name for path in HOME.iterdir() if path.is_dir()))
        raise Unusable(f"there is no problem {name!r}. Known problems: {known}")
    return tuple(json.loads((folder / file).read_text(encoding="utf-8")) for file in ("problem.json", "reference.json"))


def read_table(path):
    """Return the remarks (# key: value), the header and the rows of a CSV file, with the line each row is from."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as why:
        raise Unusable(f"{path}: cannot be read as text: {why}") from why
    remarks, header, rows = {}, None, []
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("#"):
            key, _, value = text.lstrip("# ").partition(":")
            remarks[key.strip().lower()] = value.strip()
        elif text and header is None:
            header = [cell.strip().strip('"') for cell in text.split(",")]
        elif text:
            cells = [cell.strip().strip('"') for cell in text.split(",")]
            if len(cells) != len(header):
                raise Unusable(f"{path}, line {number}: {len(cells)} values where the header has {len(header)} columns")
            rows.append((number, cells))
    if header is None:
        raise Unusable(f"{path}: empty. The first line is a header: time, then the columns")
    if "time" not in header:
        raise Unusable(f"{path}: no column 'time' among {', '.join(header[:8])}. Name it in the first line")
    if len(set(header)) != len(header):
        raise Unusable(f"{path}: a column appears twice in the header")
    return remarks, header, rows


def as_number(path, line, column, text):
    """Return a finite number, or say where there is none."""
    try:
        number = float(text)
    except ValueError:
        raise Unusable(f"{path}, line {line}, column {column!r}: {text!r} is no number") from None
    if not np.isfinite(number):
        raise Unusable(
            f"{path}, line {line}, column {column!r}: {text!r} is not finite. End the file where the solver failed"
        )
    return number


def ascending(path, rows, times):
    """Refuse times that go back."""
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        raise Unusable(f"{path}, line {rows[back[0] + 1][0]}: time goes back. Rows are in the order of time")


def read_samples(path, header, rows, problem):
    """Return times and columns by name."""
    names = [body["name"] for body in problem["bodies"]]
    needed = [f"{kind}.{name}" for kind in ("angle", "velocity") for name in names]
    missing = [name for name in needed if name not in header]
    if missing:
        raise Unusable(f"{path}: no column {missing[0]!r}. Needed: time, {', '.join(needed)}")
    wanted = [*needed, *(f"deflection.{e['name']}" for e in problem["elements"] if f"deflection.{e['name']}" in header)]
    where = {name: header.index(name) for name in ["time", *wanted]}
    columns = {
        name: np.array([as_number(path, line, name, cells[i]) for line, cells in rows]) for name, i in where.items()
    }
    ascending(path, rows, columns["time"])
    return columns


def read_events(path, header, rows, problem):
    """Return a list of (time, element, from, to)."""
    element = "element" if "element" in header else "clearance"
    for name in ("from_region", "to_region"):
        if name not in header:
            raise Unusable(f"{path}: no column {name!r}. Events need time, element, from_region, to_region")
    labels = {e["name"]: [r["region"] for r in e["regions"]] for e in problem["elements"]}
    events = []
    for line, cells in rows:
        row = dict(zip(header, cells, strict=True))
        name = row[element]
        if name not in labels:
            raise Unusable(f"{path}, line {line}: no element {name!r}. Elements: {', '.join(labels)}")
        ends = []
        for column in ("from_region", "to_region"):
            region = as_number(path, line, column, row[column])
            if region not in labels[name]:
                raise Unusable(f"{path}, line {line}: {name} has no region {row[column]}. Regions: {labels[name]}")
            ends.append(int(region))
        events.append((as_number(path, line, "time", row["time"]), name, *ends))
    ascending(path, rows, np.array([event[0] for event in events]))
    return events


# Comparing


def deflections(problem, columns):
    """Return deflections by element: those that are there, otherwise factors times angles less the error."""
    speed, time = float(problem["speed"]), columns["time"]
    values = {}
    for element in problem["elements"]:
        name = element["name"]
        if f"deflection.{name}" in columns:
            values[name] = columns[f"deflection.{name}"]
            continue
        delta = np.zeros_like(time)
        for body, factor in zip(element["bodies"], element["factors"], strict=True):
            if body != "ground":
                delta += float(factor) * columns[f"angle.{body}"]
        for h in element["error"]:
            delta -= float(h["amplitude"]) * np.sin(float(h["order"]) * speed * time + float(h["phase"]))
        values[name] = delta
    return values


def size_of(element, delta):
    """Return the scale of a deflection: its largest corner, or its largest value where it has none."""
    return max([abs(float(c)) for c in element["corners"]], default=0.0) or max(np.abs(delta).max(), 1e-300)


def compare_samples(path, rows, columns, problem, reference):
    """Return the error of every sample up to the horizon, scaled, and what is missing."""
    times = np.array(reference["times"])
    truth = dict(zip(reference["columns"], np.array(reference["states"]).T, strict=True))
    truth["time"] = times
    spacing = times[1] - times[0]
    last = times[-1]
    index = np.clip(np.rint(columns["time"] / spacing).astype(int), 0, times.size - 1)
    inside = columns["time"] <= last * (1 + 1e-9)
    off = np.abs(columns["time"] - times[index]) > 1e-6 * spacing
    if np.any(inside & off):
        row = int(np.flatnonzero(inside & off)[0])
        raise Unusable(
            f"{path}, line {rows[row][0]}: {columns['time'][row]:.17g} is no sample time. "
            f"Sample at 2 pi k / (speed * {problem['samples']['per_turn']}), near here {times[index[row]]:.17g}"
        )
    index = index[inside]
    if np.unique(index).size != index.size:
        raise Unusable(f"{path}: a sample time appears twice")
    ours, exact = deflections(problem, columns), deflections(problem, truth)
    errors, names = [], []
    for element in problem["elements"]:
        name = element["name"]
        errors.append(np.abs(ours[name][inside] - exact[name][index]) / size_of(element, exact[name]))
        names.append(f"deflection.{name}")
    for name in reference["columns"]:
        size = max(np.abs(truth[name]).max(), 1e-300)
        errors.append(np.abs(columns[name][inside] - truth[name][index]) / size)
        names.append(name)
    judged = times[index] <= reference["horizon"]
    table = np.array(errors)[:, judged]
    needed = np.flatnonzero(times <= reference["horizon"])
    return table, names, times[index][judged], int(np.setdiff1d(needed, index).size)


def match(truth, events, window):
    """Pair the events of one element in order: as many as agree in transition and lie within the window, at least cost.

    Returns pairs of indices. Missing or inventing an event costs 1, a pair its distance over the window.
    """
    n, m = len(truth), len(events)
    cost = np.zeros((n + 1, m + 1))
    cost[:, 0] = np.arange(n + 1)
    cost[0, :] = np.arange(m + 1)
    times = np.array([event[0] for event in events])
    kinds = np.array([event[2:] for event in events]).reshape(m, 2)
    pair = np.full((n, m), np.inf)
    for i, event in enumerate(truth):
        distance = np.abs(times - event[0]) / window
        same = np.all(kinds == np.array(event[2:]), axis=1) & (distance < 1.0)
        pair[i, same] = distance[same]
    for i in range(n):
        diagonal = np.minimum(cost[i, :-1] + pair[i], cost[i, 1:] + 1.0)
        row = cost[i + 1]
        # the best of skipping any number of events: a running minimum of (value - place), plus the place
        row[1:] = diagonal
        row[:] = np.minimum.accumulate(row - np.arange(m + 1)) + np.arange(m + 1)
    pairs, i, j = [], n, m
    while i and j:
        if np.isfinite(pair[i - 1, j - 1]) and cost[i, j] >= cost[i - 1, j - 1] + pair[i - 1, j - 1] - 1e-9:
            pairs.append((i - 1, j - 1))
            i, j = i - 1, j - 1
        elif cost[i, j] >= cost[i - 1, j] + 1.0 - 1e-9:
            i -= 1
        else:
            j -= 1
    return pairs[::-1]


def compare_events(events, problem, reference):
    """Return matched, missed and invented events up to the horizon, and the largest error of time."""
    horizon = reference["horizon"]
    truth = [(float(t), name, a, b) for t, name, a, b, _ in reference["events"]]
    window = float(reference["window"])
    missed, invented, distance, matched = [], [], [], 0
    for element in problem["elements"]:
        true = [event for event in truth if event[1] == element["name"]]
        mine = [event for event in events if event[1] == element["name"] and event[0] <= reference["times"][-1]]
        pairs = match(true, mine, window)
        left, right = {i for i, _ in pairs}, {j for _, j in pairs}
        matched += sum(true[i][0] <= horizon for i in left)
        distance += [abs(true[i][0] - mine[j][0]) for i, j in pairs if true[i][0] <= horizon]
        missed += [event for i, event in enumerate(true) if i not in left and event[0] <= horizon]
        invented += [event for j, event in enumerate(mine) if j not in right and event[0] <= horizon]
    return matched, sorted(missed), sorted(invented), max(distance, default=0.0)


def mean_with_width(batches):
    """Return the mean of batches and the half width of its 99 % confidence interval."""
    return float(np.mean(batches)), float(STUDENT * np.std(batches, ddof=1) / np.sqrt(len(batches)))


def statistics(columns, events, problem, begin, end):
    """Return name -> (mean, half width): mean squares of deflections and velocities, impacts a unit of time."""
    out = {}
    edges = np.linspace(begin, end, BATCHES + 1)
    if columns is not None:
        time = columns["time"]
        parts = [(time >= a) & (time < b) for a, b in pairwise(edges)]
        if min(part.sum() for part in parts) >= 10:
            values = {f"rms deflection.{k}": v for k, v in deflections(problem, columns).items()}
            values |= {f"rms {k}": v for k, v in columns.items() if k.startswith("velocity.")}
            for name, value in values.items():
                mean, width = mean_with_width([np.mean(value[part] ** 2) for part in parts])
                root = np.sqrt(mean)
                out[name] = (float(root), float(width / (2 * root)) if root else 0.0)
    if events is not None and events and events[-1][0] > edges[-2]:
        for element in problem["elements"]:
            times = np.array([t for t, name, a, b in events if name == element["name"] and abs(b) > abs(a)])
            counts = np.histogram(times, edges)[0] / (edges[1] - edges[0])
            out[f"impacts {element['name']}"] = mean_with_width(counts)
    return out


def compare_statistics(columns, events, problem, reference):
    """Return rows (name, reference, half width, value, half width, whether the intervals meet)."""
    stored = reference.get("statistics")
    if not stored:
        return []
    mine = statistics(columns, events, problem, stored["begin"], stored["end"])
    rows = []
    for name, (value, width) in stored["values"].items():
        if name in mine:
            own, own_width = mine[name]
            agree = abs(own - value) <= np.hypot(width, own_width) + 1e-12 * abs(value)
            rows.append((name, value, width, own, own_width, bool(agree)))
    return rows


def check(name, paths):
    """Return the verdict on the files of one problem."""
    problem, reference = read_problem(name)
    verdict = {"problem": name, "horizon": reference["horizon"], "faults": []}
    columns = events = None
    broken = [reference["horizon"]]
    for path in paths:
        remarks, header, rows = read_table(path)
        verdict.update({key: remarks[key] for key in ("solver", "rhs", "seconds", "steps", "failed") if key in remarks})
        if "from_region" in header or "element" in header:
            events = read_events(path, header, rows, problem)
            matched, missed, invented, distance = compare_events(events, problem, reference)
            verdict.update(matched=matched, missed=len(missed), invented=len(invented), time_error=distance)
            for word, wrong in (("missed", missed), ("invented", invented)):
                if wrong:
                    t, element, a, b = wrong[0]
                    broken.append(t)
                    verdict["faults"].append(f"{word} {len(wrong)}, the first: {element} {a} -> {b} at {t:.9g}")
        else:
            columns = read_samples(path, header, rows, problem)
            table, names, times, absent = compare_samples(path, rows, columns, problem, reference)
            verdict["missing_samples"] = absent
            if absent:
                verdict["faults"].append(f"{absent} samples up to the horizon are missing")
            worst = table.max(axis=0, initial=0.0)
            verdict["state_error"] = float(worst.max(initial=0.0))
            if times.size:
                k, i = np.unravel_index(int(np.argmax(table)), table.shape)
                verdict["worst"] = f"{names[k]} at {times[i]:.9g}"
            lost = np.flatnonzero(worst > FOLLOWED)
            if lost.size:
                broken.append(float(times[lost[0]]))
                verdict["faults"].append(
                    f"state error {verdict['state_error']:.1e} of {verdict['worst']}, above {FOLLOWED:g}"
                )
            if absent:
                broken.append(float(times[-1]) if times.size else 0.0)
    verdict["followed"] = min(broken)
    verdict["statistics"] = compare_statistics(columns, events, problem, reference)
    verdict["faults"] += [f"{row[0]}: intervals do not meet" for row in verdict["statistics"] if not row[-1]]
    if "failed" in verdict:
        verdict["faults"].append(f"the solver says that it failed: {verdict['failed']}")
    return verdict


# Command line


def jobs(arguments):
    """Return problem -> files."""
    files, folders = [], []
    for path in arguments.paths:
        if path.is_dir():
            folders.append(path)
        elif path.is_file():
            files.append(path)
        else:
            raise Unusable(f"{path}: no such file or folder")
    for folder in folders:
        inside = sorted(folder.glob("*.csv"))
        if not inside:
            raise Unusable(f"{folder}: holds no .csv file. Name results NAME.csv and NAME.events.csv")
        files += inside
    work = {}
    for path in files:
        name = arguments.problem or path.name.removesuffix(".csv").removesuffix(".events")
        if not (HOME / name / "problem.json").is_file() and not arguments.problem:
            raise Unusable(f"{path}: the name of the file is that of no problem. Rename it, or add --problem NAME")
        work.setdefault(name, []).append(path)
    return work


def text_of(verdict):
    """Return the verdict in lines."""
    good = not verdict["faults"]
    lines = [
        f"{verdict['problem']}: {'followed to the horizon' if good else 'NOT followed'} ({verdict['horizon']:.6g})"
    ]
    if not good:
        lines.append(f"  followed until {verdict['followed']:.9g}")
    if "matched" in verdict:
        lines.append(
            f"  events: {verdict['matched']} right, {verdict['missed']} missed, {verdict['invented']} invented; "
            f"largest error of time {verdict['time_error']:.1e}"
        )
    if "state_error" in verdict:
        lines.append(
            f"  states: largest scaled error {verdict['state_error']:.1e} ({verdict.get('worst', 'no sample')})"
        )
    for name, value, width, own, own_width, agree in verdict["statistics"]:
        word = "agrees" if agree else "DIFFERS"
        lines.append(f"  {name}: {own:.6g} +- {own_width:.2g}, reference {value:.6g} +- {width:.2g}: {word}")
    cost = [f"{verdict[key]} {word}" for key, word in (("rhs", "right-hand sides"), ("seconds", "s")) if key in verdict]
    if cost:
        lines.append("  cost: " + ", ".join(cost))
    return "\n".join(lines + [f"  ! {fault}" for fault in verdict["faults"]])


def main(words=None):
    """Check, print, return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="a folder of results, or files")
    parser.add_argument(
        "--problem", metavar="NAME", help="the problem that the files are of; default: from their names"
    )
    parser.add_argument("--json", action="store_true", help="print the verdicts as JSON")
    arguments = parser.parse_args(words)
    try:
        verdicts = [check(name, paths) for name, paths in jobs(arguments).items()]
    except Unusable as why:
        print(f"check.py: {why}", file=sys.stderr)
        return 2
    if arguments.json:
        print(json.dumps(verdicts, indent=1))
    else:
        print("\n".join(text_of(verdict) for verdict in verdicts))
        good = sum(not verdict["faults"] for verdict in verdicts)
        print(f"{good} of {len(verdicts)} problems followed to the horizon")
    return 0 if all(not verdict["faults"] for verdict in verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
