#!/usr/bin/env python3
"""Holds the manual to the programs.

    manual.py keys        docs/bench-file.md names every key that a bench file may have
    manual.py messages    every message of docs/troubleshooting.md stands in the source
    manual.py site        mkdocs builds the manual without a warning, all pages in it, and nothing of it comes from elsewhere
"""
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def sources(*folders):
    """All strings of the sources, as the compiler joins them."""
    text = "".join(p.read_text() for folder in folders for p in sorted((ROOT / folder).rglob("*.cpp")))
    return re.sub(r'"\s*\n\s*"', "", text)


def keys():
    page = (ROOT / "docs/bench-file.md").read_text()
    named = {word for cell in re.findall(r"`([^`\n]+)`", page) for word in re.findall(r"\w+", cell)}
    text = (ROOT / "config/bench.cpp").read_text() + "".join(p.read_text() for p in (ROOT / "drivers").glob("*/open.cpp"))
    known = {key for group in re.findall(r"only\(\s*\{([^}]*)\}", text) for key in re.findall(r'"(\w+)"', group)}
    if len(known) < 60:
        return [f"only {len(known)} keys were found in the sources: see how this test looks for them"]
    return [f"docs/bench-file.md does not name the key {key}" for key in sorted(known - named - {"driver"})]


def messages():
    text = sources("tools", "server", "config", "report", "analysis", "daemon", "hal", "drivers", "session", "model")
    rows = re.findall(r"^\| `([^`]+)` \| .*\|$", (ROOT / "docs/troubleshooting.md").read_text(), flags=re.M)
    if len(rows) < 15:
        return [f"only {len(rows)} messages were found on the page: see how this test looks for them"]
    return [f"docs/troubleshooting.md explains `{row}`, which nothing says" for row in rows if row not in text]


def site():
    with tempfile.TemporaryDirectory(prefix="emtb-manual-") as folder:
        done = subprocess.run(["mkdocs", "build", "--strict", "--quiet", "--site-dir", folder], cwd=ROOT,
                              capture_output=True, text=True)
        wrong = [done.stdout + done.stderr] if done.returncode != 0 else []
        built = pathlib.Path(folder)
        menu = (ROOT / "mkdocs.yml").read_text()
        for page in sorted((ROOT / "docs").rglob("*.md")):
            name = page.relative_to(ROOT / "docs").as_posix()
            if f": {name}\n" not in menu:
                wrong.append(f"mkdocs.yml has no entry for {name}")
        for page in built.rglob("*.html"):
            for address in re.findall(r'(?:src|<link[^>]*href)="(https?://[^"]+)"', page.read_text()):
                wrong.append(f"{page.relative_to(built)} takes {address} from elsewhere")
        return wrong


if __name__ == "__main__":
    what = {"keys": keys, "messages": messages, "site": site}
    found = what[sys.argv[1]]() if len(sys.argv) == 2 and sys.argv[1] in what else [__doc__]
    for one in found:
        print("WRONG:", one)
    sys.exit(1 if found else 0)
