#!/usr/bin/env python3
"""Counts how often `emtb investigate` finds out what a simulated bench hides.

    tests/blind/investigate_judge.py [--cases one:40,two:20,three:10] [--benches desk,fh2] [--seed 1] [--jobs 2]
                                     [--out build/investigate] [--minutes M] [--bin build/release/bin]

From outside, as a user has it: each case is a bench file of its own, with one, two or three effects hidden in the plant and its motor drawn 30 % off
the data sheet, an emtbd on it, and `emtb investigate MODEL --yes` with the shipped linear model. The command records its own runs, decides what to run next, and
foretells a last run. One line of JSON a case is appended to OUT/seed-N.jsonl; called again, it goes on. A case whose effects nobody could see (held-out error of the fitted linear
model below 1.2 noise floors) is drawn again with larger ones.

Right: every hidden effect is named, alone or in a tie of at most three, and nothing else is.
"""
import argparse
import json
import math
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VISIBLE = 1.2  # [noise floors] from which an effect is there to be found
LARGEST_TIE = 3

# What hides in `simulation:` or in a channel: id -> (section, lines with {} for the sizes on the slow and the fast bench).
# Sizes: what a worn or badly adjusted bench of that kind may have; each case takes half to twice as much.
EFFECTS = {
    "coulomb_friction": ("friction", "T_c: {}", 0.045, 0.0025),  # [N m]
    "windage": ("motor", "windage: {}", 3e-6, 2e-8),  # [N m s2/rad2]
    "brush_drop": ("motor", "brush_drop: {}", 1.5, 0.4),  # [V]
    "armature_inductance": ("motor", "L_a: {}", 1.0, 0.002),  # [H]
    "field_heating": ("motor", "field_time: 20\n    field_drop: {}", 0.04, 0.04),
    "driver_dead_zone": ("driver", "dead_zone: {}", 0.1, 0.07),  # [V]
    "driver_output_resistance": ("driver", "output_resistance: {}", 3.0, 0.2),  # [ohm]
    "driver_lag": ("driver", "lag: {}", 0.07, 0.01),  # [s]
    "driver_delay": ("driver", "delay: {}", 0.025, 0.005),  # [s]
    "load_torque": ("load", "torque: {}", 0.08, 0.012),  # [N m]
    "eddy_brake": ("load", "eddy_omega: {omega}\n    eddy_torque: {}", 0.06, 0.015),  # [N m]
    "eccentric_load": ("load", "eccentric: {}", 0.06, 0.0035),  # [N m]
    "cogging": ("shaft", "cogging_order: 4\n    cogging: {}", 0.1, 0.01),  # [N m]
    "tacho_lag": ("sensors", "tacho_lag: {}", 0.035, 0.007),  # [s]
    "tacho_ripple": ("sensors", "ripple_order: 2\n    ripple: {}", 0.012, 0.012),
    "tacho_offset": ("omega", "offset: {}", 0.8, 1.5),  # [rad/s]
    "torque_offset": ("torque", "offset: {}", 0.015, 0.015),  # [N m]
    "current_offset": ("i_a", "offset: {}", 0.02, 0.05),  # [A]
}
# Not beside each other: in one direction, or beside a dead zone, one is the other.
ALIKE = [{"coulomb_friction", "load_torque"}, {"driver_lag", "driver_delay"}, {"tacho_lag", "driver_delay"}]
COUNTS = {"one": 1, "two": 2, "three": 3}
BENCHES = {"fh2": ("fh2-simulated.yaml", "fh2.yaml", 10.0), "desk": ("desk-simulated.yaml", "desk.yaml", 1.5)}  # [s] to settle


def hidden_bench(bench, effects, sizes, rng):
    """The bench file with the effects in its plant."""
    slow = bench == "fh2"
    text = (ROOT / "config/benches" / BENCHES[bench][0]).read_text()
    text = re.sub(r"\n  friction:.*?(?=\n  \w|\Z)", "\n", text + "\n", flags=re.S)  # what the shipped plant hides
    text = re.sub(r"\nestimates:.*?\n(?=\w)", "\n", text, flags=re.S)
    text = re.sub(r"(seed: )\d+", lambda m: m[1] + str(rng.randrange(1, 10**6)), text)

    def spread(key, by):
        nonlocal text
        head, plant = text.split("\nsimulation:", 1)
        factor = rng.uniform(1 - by, 1 + by)
        plant = re.sub(rf"(\n    {key}: +)([0-9.e+-]+)", lambda m: f"{m[1]}{float(m[2]) * factor:.6g}", plant)
        text = head + "\nsimulation:" + plant
        return factor

    for key in ("R_a", "B", "J"):
        spread(key, 0.3)
    emf = spread("K_b", 0.15)
    head, plant = text.split("\nsimulation:", 1)
    text = head + "\nsimulation:" + re.sub(
        r"(\n    K_m: +)([0-9.e+-]+)", lambda m: f"{m[1]}{float(m[2]) * emf:.6g}", plant)

    for effect in effects:
        section, line, on_slow, on_fast = EFFECTS[effect]
        line = line.replace("{omega}", "60" if slow else "200").format(f"{(on_slow if slow else on_fast) * sizes[effect]:.6g}")
        if section in ("omega", "torque"):
            text = re.sub(rf"(\n      {section}: {{)", rf"\1{line}, ", text)
        elif section == "i_a":
            text = text.replace("    signal: i_a\n", f"    signal: i_a\n    {line}\n") if slow else re.sub(
                r"(\n      i_a: {)", rf"\1{line}, ", text)
        else:
            head, plant = text.split("\nsimulation:", 1)
            if f"\n  {section}:" not in plant:
                plant += f"  {section}:\n"
            plant = re.sub(rf"(\n  {section}:[^\n]*\n)", rf"\1    {line}\n", plant)
            text = head + "\nsimulation:" + plant
    return text


def draw(bench, count, rng):
    while True:
        effects = rng.sample(sorted(EFFECTS), count)
        if not any(len(alike & set(effects)) > 1 for alike in ALIKE):
            return effects


class Bench:
    """An emtbd on a bench with something hidden, and the commands that a user has."""

    def __init__(self, options, here, text):
        self.bin, self.here = options.bin, here
        (here / "bench.yaml").write_text(text)
        self.log = open(here / "emtbd.txt", "w")
        self.daemon = subprocess.Popen(
            [options.bin / "emtbd", "--config", here / "bench.yaml", "--socket", here / "s", "--data", here / "data", "--pace", "max"],
            stdout=self.log, stderr=self.log)
        for _ in range(400):
            if (here / "s").exists() or self.daemon.poll() is not None:
                break
            time.sleep(0.05)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.daemon.terminate()
        self.daemon.wait()
        self.log.close()

    def emtb(self, *arguments):
        return subprocess.run([self.bin / "emtb", "--socket", self.here / "s", *map(str, arguments)], capture_output=True, text=True, timeout=1200)

    def run(self, text):
        """@return the session's path; none where the run ended early"""
        profile = self.here / "profile.yaml"
        profile.write_text(text)
        done = self.emtb("run", profile, "--reset", "--json", self.here / "run.json")
        if done.returncode != 0:
            return None
        return json.loads((self.here / "run.json").read_text())["session"]


def investigate(options, bench, text):
    """What the command says of a bench; None where it did not end."""
    model, settle = BENCHES[bench][1:]
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        with Bench(options, here, text) as at:
            began = time.monotonic()
            done = at.emtb("investigate", ROOT / "config/models" / model, "--yes", "--reset", "--settle", settle, "--out", here / "found", "--json",
                           here / "all.json")
            seconds = time.monotonic() - began
        if not (here / "all.json").exists():
            return None, (done.stderr + (here / "emtbd.txt").read_text())[-2000:]
        result = json.loads((here / "all.json").read_text())
        result["seconds"] = seconds
        return result, ""


def judge(options, kind, number):
    """One case, as its line of the results."""
    rng = random.Random(f"{options.seed} {kind} {number}")
    bench = options.benches[number % len(options.benches)]
    effects = draw(bench, COUNTS[kind], rng)
    sizes = {effect: math.exp(rng.uniform(math.log(0.5), math.log(2))) for effect in effects}
    state = rng.getstate()
    case = {"case": f"{kind}:{number}", "bench": bench, "truth": sorted(effects)}
    for _ in range(4):
        rng.setstate(state)
        result, error = investigate(options, bench, hidden_bench(bench, effects, sizes, rng))
        if result is None:
            return case | {"failed": error}
        if result["rounds"][-1]["base"] >= VISIBLE:
            break
        sizes = {effect: 1.8 * size for effect, size in sizes.items()}
    last = result["rounds"][-1]
    named = [[one["id"], *one["tied_with"]] for one in last["missing"]]
    hit = [effect for effect in effects if any(effect in tie and len(tie) <= LARGEST_TIE for tie in named)]
    extra = [tie[0] for tie in named if not set(tie) & set(effects) or len(tie) > LARGEST_TIE]
    confirmed = result["confirmed"]
    return case | {
        "sizes": sizes, "verdict": last["verdict"], "named": named, "hit": len(hit), "extra": extra, "visible": last["base"] >= VISIBLE,
        "base": last["base"], "final": last["final"], "rounds": len(result["rounds"]), "answers": [r["verdict"] for r in result["rounds"]],
        "foretold": confirmed and confirmed["final"]["chained_error"], "seconds": result["seconds"]}


def interval(hits, of):
    """Wilson's, 95 %."""
    if of == 0:
        return "-"
    z, p = 1.96, hits / of
    middle, reach = (p + z * z / 2 / of) / (1 + z * z / of), z * math.sqrt(p * (1 - p) / of + z * z / 4 / of / of) / (1 + z * z / of)
    return f"{100 * p:.0f} % ({hits} of {of}; {100 * max(0, middle - reach):.0f} to {100 * min(1, middle + reach):.0f} %)"


def report(cases):
    shown = [c for c in cases if c.get("visible")]
    print(f"{len(cases)} cases, {sum('failed' in c for c in cases)} failed, {sum(c.get('visible') is False for c in cases)} showed nothing\n")
    for kind, count in COUNTS.items():
        mine = [c for c in shown if c["case"].startswith(kind + ":")]
        if not mine:
            continue
        right = [c for c in mine if c["hit"] == count and not c["extra"]]
        print(f"{kind}: right {interval(len(right), len(mine))}")
        if count > 1:
            most = [c for c in mine if c["hit"] >= count - 1]
            print(f"  at least {count - 1} of {count} named: {interval(len(most), len(mine))}")
        foretold = [c["foretold"] for c in right if c["foretold"]]
        if foretold:
            print(f"  error of the run foretold, median where right: {statistics.median(foretold):.3f} noise floors")
        print(f"  rounds {statistics.mean(c['rounds'] for c in mine):.1f}, {statistics.median(c['seconds'] for c in mine):.1f} s in the median")
        for c in mine:
            if c not in right:
                named = ", ".join(" ~ ".join(tie) for tie in c["named"]) or "nothing"
                print(f"  miss {c['case']} ({c['bench']}): {' + '.join(c['truth'])} -> {c['verdict']}: {named}; {c['base']:.2f} -> {c['final']:.2f}")
    for c in cases:
        if "failed" in c:
            print(f"failed {c['case']} ({c['bench']}, {' + '.join(c['truth'])}): {c['failed'].strip()[-300:]}")


def asked(description, out, **cases):
    """What the command line asks for, the file that keeps the answers, and those that are in it."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", **cases)
    parser.add_argument("--benches", default="desk,fh2", type=lambda text: text.split(","))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / out)
    parser.add_argument("--minutes", type=float, default=math.inf)
    parser.add_argument("--bin", type=Path, default=ROOT / "build/release/bin")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / f"seed-{options.seed}.jsonl"
    return options, file, [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def answered(options, file, cases, wanted, judge, tell):
    """All answers: those that are known, and as time allows those to the rest of what is wanted, each kept as it comes.

    wanted: what a case is called, and what judge() needs to know of it; tell: of an answer, for the screen
    """
    known = {c["case"] for c in cases}
    until = time.monotonic() + 60 * options.minutes

    def run(name, *of):
        return None if name in known or time.monotonic() > until else judge(options, *of)

    with ThreadPoolExecutor(options.jobs) as pool, open(file, "a") as out:
        for line in pool.map(lambda case: run(*case), wanted):
            if line is None:
                continue
            cases.append(line)
            out.write(json.dumps(line) + "\n")
            out.flush()
            print(line["case"], line["bench"], *tell(line), file=sys.stderr)
    return cases


def main():
    options, file, cases = asked(__doc__, "investigate", default="one:40,two:20,three:10")
    wanted = [(f"{kind}:{n}", kind, n) for kind, _, count in (part.partition(":") for part in options.cases.split(",")) for n in range(int(count))]
    wanted.sort(key=lambda case: case[2])  # of each kind some, should the time run out
    report(answered(options, file, cases, wanted, judge,
                    lambda line: ("+".join(line["truth"]), "->", line.get("verdict", "failed"), line.get("named"))))


if __name__ == "__main__":
    main()
