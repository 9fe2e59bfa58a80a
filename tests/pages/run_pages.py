#!/usr/bin/env python3
"""Holds README.md and docs/ to what they say.

    run_pages.py commands --build DIR [--pages PAGE...]
                                         runs every block marked `sh`, in a folder as ./run.sh leaves it, and the readers
                                         in Python and Octave of docs/sessions.md beside its sessions
    run_pages.py numbers                 counts and words of README.md stand in the pages that it takes them from

Prints what is wrong and where; exit code 1 if anything is.
"""
import argparse
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["README.md", *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md"))]
# A reader waits until a daemon answers; a script must be told.
AWAIT = 'for _ in $(seq 200); do [ -S "{}" ] && break; sleep 0.05; done'


def blocks(text):
    """(line, kind, text) of each fenced block."""
    for match in re.finditer(r"^```(\w*)\n(.*?)^```$", text, flags=re.S | re.M):
        yield text.count("\n", 0, match.start()) + 1, match[1], match[2]


def script_of(block):
    lines = []
    for line in block.splitlines():
        # A person is asked whether the motor may move; a script must say so.
        line = line.replace("emtb bench spin --reset", "emtb bench spin --reset --yes")
        lines.append(line.replace("/usr/share/emtb/", "config/"))  # what the page says of the package
        if re.match(r"emtbd .*&\s*(#.*)?$", line):
            socket = re.search(r"--socket (\S+)", line)
            lines.append(AWAIT.format(socket[1] if socket else "$XDG_RUNTIME_DIR/emtb.sock"))
    return "set -euo pipefail\ntrap 'kill $(jobs -p) 2>/dev/null || true; wait || true' EXIT\n" + "\n".join(lines) + "\n"


def run(script, root, environment, seconds=300):
    """(exit code, output); what it left behind is ended."""
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(["bash", "-c", script], cwd=root, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=said, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            code = -1
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()
        said.seek(0)
        return code, said.read()


def reader_of(kind, block):
    """A script that runs some lines of another language on build/story/staircase.h5 and wants readings of them."""
    wanted = {"python": "assert len(t) == len(omega) > 1000 and max(omega) > 50",
              "octave": "assert (numel (t) == numel (omega) && numel (t) > 1000 && max (omega) > 50)"}[kind]
    program = {"python": "/usr/bin/python3 -", "octave": "octave-cli --no-gui --norc --quiet"}[kind]
    return f"cd build/story\n{program} <<'END_OF_LINES'\n{block}{wanted}\nEND_OF_LINES\n"


def commands(build, pages=PAGES):
    wrong, count, readers = [], 0, 0
    with tempfile.TemporaryDirectory(prefix="emtb-pages-") as folder:
        root = pathlib.Path(folder)
        root.chmod(0o755)  # a program that root starts as a device becomes nobody
        shutil.copytree(ROOT / "config", root / "config")  # a reader may write there
        for name in ("docs", "tools"):
            (root / name).symlink_to(ROOT / name)
        (root / "build").mkdir()
        (root / "build/release").symlink_to(build)
        (root / "run").mkdir()
        environment = os.environ | {"XDG_RUNTIME_DIR": str(root / "run"), "EMTB_DATA": str(root / "none"),
                                    "PATH": f"{build}/bin:{os.environ['PATH']}"}
        code, said = run("tools/story.sh", root, environment)
        if code != 0 or "missing  coulomb_friction" not in said:
            print(f"WRONG: tools/story.sh ended with {code}:\n{said}")
            return 1
        for page in pages:
            for line, kind, block in blocks((ROOT / page).read_text()):
                reader = page == "docs/sessions.md" and kind in ("python", "octave")
                if kind != "sh" and not reader:
                    continue
                begin = time.monotonic()
                code, said = run(reader_of(kind, block) if reader else script_of(block), root, environment)
                readers += reader
                count += 1
                print(f"{page}:{line}: {time.monotonic() - begin:.1f} s", flush=True)
                if code != 0:
                    wrong.append(f"{page}:{line} ended with {code}:\n{said[-3000:]}")
    for one in wrong:
        print("WRONG:", one)
    return 0 if (pages is not PAGES or (count > 8 and readers >= 2)) and not wrong else 1


def numbers():
    readme, accuracy = (ROOT / "README.md").read_text(), (ROOT / "docs/blind.md").read_text()
    wrong = [f"README.md says {count}, docs/blind.md does not" for count in re.findall(r"\d+ of \d+", readme)
             if not re.search(rf"\b{count}\b", accuracy)]
    effects = len(list((ROOT / "model/effects").glob("*/*.h")))
    if f"[{effects} of them]" not in readme:
        wrong.append(f"README.md does not say that there are {effects} effects")
    wrong += [f"README.md:{line}: a block without a kind: mark it `sh` and it is run, or `text`"
              for line, kind, _ in blocks(readme) if not kind and "./run.sh" not in _]
    in_table_or_block = False
    for n, line in enumerate(readme.splitlines(), 1):
        in_table_or_block ^= line.startswith("```")
        if len(line) > 100 and not in_table_or_block and not line.startswith(("|", "!")):
            wrong.append(f"README.md:{n}: {len(line)} characters")
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (ROOT / page).read_text()):
            if not (ROOT / page).parent.joinpath(target).exists():
                wrong.append(f"{page} leads to {target}, which is not there")
    for one in wrong:
        print("WRONG:", one)
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["commands", "numbers"])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--pages", nargs="+", help="those alone, such as docs/install.md")
    given = parser.parse_args()
    return commands(given.build.resolve(), given.pages or PAGES) if given.what == "commands" else numbers()


if __name__ == "__main__":
    sys.exit(main())
