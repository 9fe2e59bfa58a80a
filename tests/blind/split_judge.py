#!/usr/bin/env python3
"""Counts how often the experiment that `emtb investigate` proposes splits a tie, against a random one of the same length.

    tests/blind/split_judge.py [--cases 100] [--benches desk,fh2] [--seed 1] [--jobs 2] [--out build/split] [--minutes M] [--bin build/release/bin]

Each case is a bench of investigate_judge.py with one hidden effect, half of them without the torque gauge, and two recordings that tell little: three levels within
a fifth of each other, without the start, to fit to, and three others to judge by. Where the diagnosis of these names the effect in a tie, and the command proposes an experiment, both are made on the same bench, each once to fit to and
once to judge by: the proposed one, and one whose kind, levels and times are drawn at random. Split: the next diagnosis names the hidden effect alone.
One line of JSON a case is appended to OUT/seed-N.jsonl; called again, it goes on.
"""
import json
import math
import random
import re
import tempfile
from pathlib import Path

from investigate_judge import BENCHES, ROOT, Bench, answered, asked, hidden_bench, interval

# Of what investigate_judge.py can hide, what another effect may look like.
LIKELY = ["coulomb_friction", "windage", "brush_drop", "armature_inductance", "driver_dead_zone", "driver_output_resistance", "driver_lag", "driver_delay",
          "load_torque", "eddy_brake", "tacho_lag", "tacho_offset"]
REACH = {"fh2": (0.5, 5.4), "desk": (-3.0, 3.0)}  # [V] of random levels: as far as config/profiles/*_random.yaml go
LENGTH = re.compile(r"to judge by: .* ([0-9.]+) s\)\?")


def drawn_profile(rng, bench, length, name):
    """A run of that length [s], of any kind."""
    low, high = REACH[bench]
    before, after = 0.05 * length, 0.25 * length
    held = length - before - after
    level = lambda: round(rng.choice([high, low] if low < 0 else [high]) * rng.uniform(0.2, 1), 2)
    kind = rng.choice(["step", "ramp", "staircase", "random_steps"])
    if kind == "step":
        lines = [f"level: {level()}", f"before: {before}", f"hold: {held}", f"after: {after}"]
    elif kind == "ramp":
        to, rise = level(), rng.uniform(0.2, 0.45) * held
        lines = [f"level: {to}", f"rate: {abs(to) / rise}", f"before: {before}", f"hold: {held - 2 * rise}", f"after: {after}"]
    elif kind == "staircase":
        count = rng.randint(2, 5)
        lines = [f"levels: {[level() for _ in range(count)]}", f"before: {before}", f"hold: {held / count}", f"after: {after}"]
    else:
        lines = [f"low: {low}", f"high: {high}", f"shortest: {0.03 * held}", f"longest: {0.2 * held}", f"before: {before}", f"total: {held}",
                 f"after: {after}", f"seed: {rng.randrange(1, 10**6)}"]
    return kind, "\n".join([f"name: {name}", f"kind: {kind}", *lines]) + "\n"


def ties_with(missing, effect):
    """What is named where the effect is, alone or among others; nothing where it is not."""
    return next((tie for tie in ([one["id"], *one["tied_with"]] for one in missing) if effect in tie), [])


def judge(options, number):
    rng = random.Random(f"{options.seed} split {number}")
    bench = options.benches[number % len(options.benches)]
    effect = rng.choice(LIKELY)
    size = math.exp(rng.uniform(math.log(0.7), math.log(3)))
    case = {"case": number, "bench": bench, "truth": effect, "size": size}
    model, settle = BENCHES[bench][1:]
    model = ROOT / "config/models" / model
    high = REACH[bench][1]
    text = hidden_bench(bench, [effect], {effect: size}, rng)
    if rng.random() < 0.5:
        text, case["gauge"] = re.sub(r"\n(?:  |      )torque: [^\n]*", "", text), False
    about = rng.uniform(0.4, 0.8) * high  # [V]
    with tempfile.TemporaryDirectory() as folder, Bench(options, Path(folder), text) as at:
        def around(name):
            levels = [round(about * rng.uniform(0.9, 1.1), 3) for _ in range(3)]
            session = at.run(f"name: {name}\nkind: staircase\nlevels: {levels}\nbefore: {0.1 * settle}\nhold: {settle}\nafter: {0.1 * settle}\n")
            return session and f"{session}@{settle}:{3 * settle}"

        fit, by = around("first_fit"), around("first_judge")
        if fit is None or by is None:
            return case | {"failed": (at.here / "emtbd.txt").read_text()[-1000:]}
        done = at.emtb("investigate", model, "--sessions", fit, "--held-out", by, "--rounds", 2, "--yes", "--no-confirm", "--settle", settle, "--out",
                       at.here / "found", "--json", at.here / "all.json")
        if not (at.here / "all.json").exists():
            return case | {"failed": done.stderr[-1000:]}
        rounds = json.loads((at.here / "all.json").read_text())["rounds"]
        tie = ties_with(rounds[0]["missing"], effect)
        case |= {"verdict": rounds[0]["verdict"], "tie": tie}
        if rounds[0]["verdict"] != "tied" or len(tie) < 2:
            return case
        length = LENGTH.search(done.stdout)
        case["proposed"] = len(rounds) > 1
        if case["proposed"]:
            case["after"] = ties_with(rounds[1]["missing"], effect)
        seconds = float(length[1]) if length else 2 * settle
        case["seconds"] = seconds
        for _ in range(5):  # where one ends at a limit of the bench, another
            case["kind"], text = drawn_profile(rng, bench, seconds, "drawn")
            more, judged = at.run(text), at.run(text)
            if more is not None and judged is not None:
                break
        else:
            return case | {"failed": "no random run ended well"}
        done = at.emtb("diagnose", model, fit, more, "--held-out", by, "--held-out", judged, "--json", at.here / "drawn.json")
        if not (at.here / "drawn.json").exists():
            return case | {"failed": done.stderr[-1000:]}
        case["after_random"] = ties_with(json.loads((at.here / "drawn.json").read_text())["missing"], effect)
    return case


def report(cases):
    failed = [c for c in cases if "failed" in c]
    tied = [c for c in cases if c.get("tie") and "after_random" in c]
    can = [c for c in tied if c["proposed"]]
    cannot = [c for c in tied if not c["proposed"]]
    alone = lambda c, key: c[key] == [c["truth"]]
    print(f"{len(cases)} cases, {len(failed)} failed; {len(tied)} named the effect in a tie")
    print(f"an experiment was proposed for {len(can)} of them")
    print(f"  split by the proposed run: {interval(sum(alone(c, 'after') for c in can), len(can))}")
    print(f"  split by a random run:     {interval(sum(alone(c, 'after_random') for c in can), len(can))}")
    print(f"where none of the menu was said to help, split by a random run: {interval(sum(alone(c, 'after_random') for c in cannot), len(cannot))}")
    for c in can:
        if not alone(c, "after"):
            print(f"  not split, case {c['case']} ({c['bench']}, {c['truth']}): {' ~ '.join(c['tie'])} -> {' ~ '.join(c['after']) or 'not named'};"
                  f" {c['kind']}: {' ~ '.join(c['after_random']) or 'not named'}")
    for c in cannot:
        print(f"  said to be beyond the menu, case {c['case']} ({c['bench']}, {c['truth']}): {' ~ '.join(c['tie'])}"
              f"; {c['kind']}: {' ~ '.join(c['after_random']) or 'not named'}")
    for c in failed:
        print(f"  failed, case {c['case']} ({c['bench']}, {c['truth']}): {c['failed'].strip()[-300:]}")


def main():
    options, file, cases = asked(__doc__, "split", type=int, default=100)
    report(answered(options, file, cases, [(number, number) for number in range(options.cases)], judge,
                    lambda line: (line["truth"], line.get("tie"), line.get("after"), line.get("after_random"))))


if __name__ == "__main__":
    main()
