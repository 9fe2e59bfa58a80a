#!/usr/bin/env python3
"""Draws docs/pictures/story.svg from what ./run.sh left in build/story: the picture of the README. Standard library only."""
import csv
import json
import pathlib
import subprocess

root = pathlib.Path(__file__).resolve().parents[2]
work = root / "build/story"
emtb = root / "build/release/bin/emtb"

# Okabe and Ito's colours: told apart by colour-blind eyes too.
MEASURED, LINEAR, EFFECT, INK, FAINT = "#7f7f7f", "#D55E00", "#0072B2", "#222222", "#dddddd"


def series(path, column, every=50):
    """Means over `every` rows: (t, value)."""
    points, t, values = [], [], []
    with open(path) as file:
        for row in csv.DictReader(file):
            if row[column]:
                t.append(float(row["t_s"]))
                values.append(float(row[column]))
            if len(t) == every:
                points.append((sum(t) / every, sum(values) / every))
                t, values = [], []
    return points


def simulated(model):
    """Speed, and the current as a meter with a window of 0.4 s reads it."""
    out = work / f"{model}.csv"
    subprocess.run([emtb, "simulate", work / f"{model}.yaml", "fh2_staircase", "--out", out], check=True, stdout=subprocess.DEVNULL)
    return series(out, "omega_rad_s"), series(out, "i_a_A", 400)


def line(points, x, y, colour, width=1.6):
    path = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"/>'


def text(x, y, words, colour=INK, anchor="start", size=13, weight="normal"):
    return f'<text x="{x}" y="{y}" fill="{colour}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}">{words}</text>'


def axis(left, top, width, height, y, ticks, unit):
    parts = []
    for tick in ticks:
        parts.append(f'<line x1="{left}" x2="{left + width}" y1="{y(tick):.1f}" y2="{y(tick):.1f}" stroke="{FAINT}"/>')
        parts.append(text(left - 8, f"{y(tick) + 4:.1f}", f"{tick:g}", anchor="end", size=12))
    parts.append(text(left, top - 10, unit, size=13, weight="bold"))
    return parts


def main():
    subprocess.run([emtb, "export", work / "staircase.h5", "--out", work / "staircase.csv"], check=True, stdout=subprocess.DEVNULL)
    measured = series(work / "staircase.csv", "omega_rad_s")
    meter = [(t - 0.2, i) for t, i in series(work / "staircase.csv", "i_a_A", 1)]  # in the middle of its window
    runs = {"linear": simulated("linear"), "with-effect": simulated("with-effect")}
    steps = json.loads((work / "diagnosis.json").read_text())["steps"]

    end = measured[-1][0]
    x = lambda t: 70 + 560 * t / end
    speed = lambda w: 200 - 150 * w / 170
    parts = axis(70, 50, 560, 150, speed, (0, 50, 100, 150), "speed [rad/s], a run that no fit has seen")
    parts += [line(measured, x, speed, MEASURED, 4), line(runs["linear"][0], x, speed, LINEAR), line(runs["with-effect"][0], x, speed, EFFECT)]
    low, high = -0.1, 0.3
    current = lambda i: 450 - 200 * (max(low, min(high, i)) - low) / (high - low)
    parts += axis(70, 250, 560, 200, current, (-0.1, 0, 0.1, 0.2, 0.3), "current [A]")
    parts += [line(meter, x, current, MEASURED, 4), line(runs["linear"][1], x, current, LINEAR),
              line(runs["with-effect"][1], x, current, EFFECT)]
    for t in range(0, int(end) + 1, 10):
        parts.append(text(f"{x(t):.0f}", 468, f"{t} s", anchor="middle", size=12))

    parts.append(text(700, 40, "error on held-out runs", weight="bold"))
    parts.append(text(700, 57, "1 = noise floor", size=12))
    top = max(step["held_out"] for step in steps)
    for i, step in enumerate(steps):
        height = 330 * step["held_out"] / top
        colour = LINEAR if i == 0 else EFFECT
        parts.append(f'<rect x="{710 + 115 * i}" y="{430 - height:.1f}" width="70" height="{max(height, 2):.1f}" fill="{colour}"/>')
        parts.append(text(745 + 115 * i, f"{422 - height:.1f}", f"{step['held_out']:.3g}", anchor="middle", weight="bold"))
        parts.append(text(745 + 115 * i, 450, "linear model" if i == 0 else "+ " + step["added"].replace("_", " "), anchor="middle", size=12))
    for i, (words, colour) in enumerate((("measured", MEASURED), ("linear model", LINEAR), ("with the effect found", EFFECT))):
        parts.append(f'<line x1="{300 + 110 * i}" x2="{318 + 110 * i}" y1="226" y2="226" stroke="{colour}" stroke-width="4"/>')
        parts.append(text(323 + 110 * i, 230, words, size=12))
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 485" font-family="sans-serif">'
    background = '<rect width="960" height="485" fill="#ffffff"/>'
    (root / "docs/pictures/story.svg").write_text("\n".join([head, background, *parts, "</svg>"]) + "\n")


main()
