#!/usr/bin/env python3
"""Writes docs/effects.md and the pictures of docs/pictures/effects from what emtb itself says and simulates.

    effects.py [EMTB]            writes both
    effects.py --check [EMTB]    says whether the page is what emtb says now; exit code 1 if not
"""
import json
import pathlib
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE, PICTURES = ROOT / "docs/effects.md", ROOT / "docs/pictures/effects"
WIDTH = 100  # columns
# The servo of config/models/desk.yaml turns both ways, but is small: on it these would be out of all proportion.
ON_THE_LARGER = ("driver_saturation", "armature_inductance", "armature_reaction", "backlash", "shaft_compliance")
LARGER = ["--model", "config/models/fh2.yaml", "--profile", "fh2_staircase"]

HEAD = """# The effects

What a model may lack, in the order of the [signal chain](model.md). `emtb effects ID` says the same.

Each picture is what the effect, at a size that is typical of it, leaves of a model that lacks it: both are simulated
without noise, and the model is fitted as well as it can be. What you see is what no other parameter imitates. A driver's
effect shows in the voltage alone where that is measured, for the measured voltage drives the motor.

This page and its pictures are made by `docs/pictures/effects.py` from what emtb says.
"""


def filled(text):
    return "\n".join(textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False))


NO_LIMIT = 1e12  # from here on a value stands for none


def value(number):
    return "" if number is None else "no limit" if number >= NO_LIMIT else f"{number:g}"


def parameters(effect):
    lines = ["| parameter | unit | absent at | from | to |", "|---|---|---|---|---|"]
    for p in effect["parameters"]:
        numbers = " | ".join(value(p[key]) for key in ("absent_at", "min", "max"))
        lines.append(f"| `{p['symbol']}` | {p['unit']} | {numbers} |")
    return "\n".join(lines)


def section(effect):
    parts = [f"### {effect['id']}", filled(effect["what"]), f"```text\n{effect['equation']}\n```"]
    picture = PICTURES / f"{effect['id']}.svg"
    if picture.exists():
        parts.append(f"![What {effect['name']} leaves of a model that lacks it](pictures/effects/{effect['id']}.svg)")
    parts += [filled("**How it shows.** " + effect["shows"]), filled("**Told apart.** " + effect["told_apart"])]
    if effect["needs"]:
        parts.append(filled("**Needs** " + effect["needs"] + "."))
    if effect["parameters"]:
        parts.append(parameters(effect))
    parts.append(filled("Source: " + effect["source"]))
    return "\n\n".join(parts)


def page(effects):
    parts, stage = [HEAD.rstrip()], None
    for effect in effects:
        if effect["stage"] != stage:
            stage = effect["stage"]
            parts.append(f"## {stage[0].upper()}{stage[1:]}")
        parts.append(section(effect))
    return "\n\n".join(parts) + "\n"


def draw(emtb, effect):
    """One picture; some effects show in no run without a load, and get none."""
    PICTURES.mkdir(exist_ok=True)
    picture = PICTURES / f"{effect['id']}.svg"
    more = LARGER if effect["id"] in ON_THE_LARGER else []
    done = subprocess.run([emtb, "effects", effect["id"], "--picture", str(picture), *more], cwd=ROOT,
                          capture_output=True, text=True)
    if done.returncode != 0:
        print(f"{effect['id']} has no picture: {done.stderr.strip()}")


def main():
    rest = [a for a in sys.argv[1:] if a != "--check"]
    emtb = str(pathlib.Path(rest[0] if rest else ROOT / "build/release/bin/emtb").resolve())
    effects = json.loads(subprocess.check_output([emtb, "effects", "--json", "-"]))
    if "--check" in sys.argv:
        if PAGE.read_text() == page(effects):
            return 0
        print("docs/effects.md is not what emtb says: run docs/pictures/effects.py")
        return 1
    for effect in effects:
        draw(emtb, effect)
    PAGE.write_text(page(effects))
    return 0


if __name__ == "__main__":
    sys.exit(main())
