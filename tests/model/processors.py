#!/usr/bin/env python3
"""Does the program run on a processor that has not what its innermost loops are also compiled for?

    processors.py objects LIBRARY...        no object of these libraries has an instruction of AVX but those compiled
                                            for it, and of those nothing but the entry is seen outside
    processors.py old EMTB MODEL PROFILE    runs a simulation on a processor of 2004, where qemu-x86_64 is installed

77 on exit: cannot be told here.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
ENTRY = "_forILNS_9ProcessorE"
FOR_ONE_PROCESSOR = re.compile(r"_(avx2)\.o$")
AVX = re.compile(r"\tv[a-z0-9]+ +.*%[xyz]mm|%[yz]mm")


def said(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def strays(name, symbols):
    """Of an object for one processor: symbols that the linker might take for the whole program."""
    return [f"{name}: `{line}` is seen outside" for line in symbols.splitlines()
            if re.search(r" [A-TV-Zuvw] ", line) and not re.search(r" [Uw] ", line) and ENTRY not in line]


def instructions(name, code):
    """Of any other object: the first instruction of AVX."""
    for line in code.splitlines():
        if AVX.search(line):
            return [f"{name}: has `{line.split(chr(9), 2)[-1].strip()}`, and is to run on any processor"]
    return []


def look_at_objects(libraries):
    wrong, looked_at, for_one = [], 0, 0
    for library in libraries:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["ar", "x", os.path.abspath(library)], cwd=folder, check=True)
            for name in sorted(os.listdir(folder)):
                path = os.path.join(folder, name)
                if FOR_ONE_PROCESSOR.search(name):
                    for_one += 1
                    wrong += strays(name, said("nm", path))
                    if "group section" in said("readelf", "-gW", path):
                        wrong.append(f"{name}: has groups, of which the linker keeps one copy")
                    if not instructions(name, said("objdump", "-d", "--no-show-raw-insn", path)):
                        wrong.append(f"{name}: has no instruction of the processor that it is for")
                else:
                    wrong += instructions(name, said("objdump", "-d", "--no-show-raw-insn", path))
                looked_at += 1
    if looked_at == 0 or for_one == 0:
        wrong.append(f"{looked_at} objects, {for_one} of them for one processor: there must be some of both")
    print("\n".join(wrong) or f"{looked_at} objects, {for_one} of them for one processor")
    return 1 if wrong else 0


def run_on_an_old_one(emtb, model, profile):
    if not shutil.which("qemu-x86_64"):
        print("qemu-x86_64 is not installed")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        results = []
        for simulator in (["qemu-x86_64", "-cpu", "qemu64"], []):
            out = os.path.join(folder, f"{len(results)}.csv")
            subprocess.run([*simulator, emtb, "simulate", model, profile, "--out", out], check=True)
            with open(out, encoding="utf-8") as file:
                lines = [line for line in file if line[0] in "0123456789-"]
            results.append([[float(v or "nan") for v in line.split(",")] for line in lines])
        old, here = results
        worst = max(abs(a - b) / max(1.0, abs(b)) for x, y in zip(old, here) for a, b in zip(x, y) if a == a or b == b)
        print(f"{len(old)} rows; the largest difference from this machine: {worst:g}")
        return 0 if len(old) == len(here) > 100 and worst < 1e-9 else 1


if __name__ == "__main__":
    what, arguments = sys.argv[1], sys.argv[2:]
    sys.exit(look_at_objects(arguments) if what == "objects" else run_on_an_old_one(*arguments))
