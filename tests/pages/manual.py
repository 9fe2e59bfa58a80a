#!/usr/bin/env python3
"""Holds the manual to the programs.

    manual.py keys        docs/bench-file.md and the schema name every key that a bench file may have, and no other
    manual.py schema      config/bench.schema.json is a JSON schema by other people's judgement, and so are the benches
    manual.py messages    every message of docs/troubleshooting.md stands in the source
    manual.py site        mkdocs builds the manual without a warning, all pages in it, and nothing of it comes from elsewhere
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCHEMA = ROOT / "config/bench.schema.json"
SIGNALS = {"u_ref", "e_a", "i_a", "omega", "theta", "torque", "i_f", "temperature"}


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
    schema = schema_keys(json.loads(SCHEMA.read_text()))
    wrong = [f"docs/bench-file.md does not name the key {key}" for key in sorted(known - named - {"driver"})]
    wrong += [f"{SCHEMA.name} does not have the key {key}" for key in sorted(known - schema)]
    wrong += [f"{SCHEMA.name} has the key {key}, which no reader knows" for key in sorted(schema - known - SIGNALS)]
    effects = {name for p in (ROOT / "model/effects").rglob("*.h") for name in re.findall(r'\.id = "(\w+)"', p.read_text())}
    hides = [row.split("|")[3] for row in page.splitlines() if row.startswith("| `") and row.count("|") == 4]
    hidden = {name for cell in hides for name in re.findall(r"`(\w+)`", cell)}
    if len(hidden) < 25:
        wrong.append(f"only {len(hidden)} effects are said to be hidden by a key: see how this test looks for them")
    return wrong + [f"docs/bench-file.md says that a key hides {name}, which is no effect" for name in sorted(hidden - effects)]


def schema_keys(part):
    """All keys that a schema knows."""
    if isinstance(part, list):
        return set().union(*map(schema_keys, part))
    if not isinstance(part, dict):
        return set()
    own = set(part["properties"]) if isinstance(part.get("properties"), dict) else set()
    return own.union(*map(schema_keys, part.values()))


def schema():
    import jsonschema
    import yaml
    wanted = json.loads(SCHEMA.read_text())
    jsonschema.Draft7Validator.check_schema(wanted)
    wrong, benches = [], sorted((ROOT / "config/benches").glob("*.yaml"))
    for bench in benches:
        for error in jsonschema.Draft7Validator(wanted).iter_errors(yaml.safe_load(bench.read_text())):
            wrong.append(f"{bench.name}: {error.json_path}: {error.message}")
    spoilt = yaml.safe_load(benches[0].read_text())
    spoilt["limits"]["omega"] = -1
    del spoilt["reference"]["safe"]
    if len(list(jsonschema.Draft7Validator(wanted).iter_errors(spoilt))) != 2:
        wrong.append("a negative limit and a missing safe value are no errors")
    return wrong


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
        return wrong + dead_places(built)


def dead_places(built):
    """Links of the site to a place of a page that the page does not have."""
    texts = {page.resolve(): page.read_text() for page in built.resolve().rglob("*.html")}
    wrong = []
    for page, text in texts.items():
        for path, place in re.findall(r'href="([^":#?]*)#([^"]+)"', text):
            target = (page.parent / path).resolve() if path else page
            if target in texts and f'id="{place}"' not in texts[target]:
                wrong.append(f"{page.name} leads to {path}#{place}, which is not there")
    return wrong


if __name__ == "__main__":
    what = {"keys": keys, "schema": schema, "messages": messages, "site": site}
    found = what[sys.argv[1]]() if len(sys.argv) == 2 and sys.argv[1] in what else [__doc__]
    for one in found:
        print("WRONG:", one)
    sys.exit(1 if found else 0)
