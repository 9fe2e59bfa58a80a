#!/usr/bin/env python3
"""The house checks itself: what includes what, how long files and functions are, that no effect is known by its
id, and that the files that pages name are there.

    house.py [arrows|rules|length|functions|effects|pages|itself] [--root DIR]

Prints what is wrong and where; exit code 1 if anything is. Without a name: all of it.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

import rooms as house

# What is wrong today and to be mended: as it is printed, without line numbers and with N for a count. To be emptied.
NOT_YET = """
"""

LONGEST_FILE, LONGEST_FUNCTION = 500, 80  # lines

# Rules that the table itself has to keep, whoever edits it: (rooms, what they must never reach, why).
ANALYSIS = r"analysis/(numerics|record|fit|estimate|live|diagnose)"
RULES = [
    (r"hal", r".*", "hal depends on nothing"),
    (r".*", r"daemon|tools", "nothing imports daemon or tools"),
    (r"model", r"(?!hal).*", "the physics knows no files"),
    (ANALYSIS, r"server|drivers|figures|report|paper", "the analysis knows no socket, no device and no page"),
    (r"analysis/live|daemon", r"analysis/(fit|diagnose|investigate)", "long analyses run in processes of the client's"),
]

# Libraries that one room hides from the others: the start of an include, and who may have it.
LIBRARIES = {
    "Eigen/|unsupported/Eigen": ["model"] + ["analysis/" + r for r in "numerics record fit live diagnose discover".split()],
    "yaml-cpp/|muParser": ["config"],
    "hdf5|H5|matio.h": ["session"],
    "boost/asio|boost/beast|sys/socket.h|sys/un.h": ["server"],
    "libusb|modbus/|comedilib": ["drivers"],
    "librsvg/|cairo": ["figures"],
}


def without_comments(text):
    """C++ without its comments, line by line as before; literals stay."""
    def blank(match):
        return match[0] if match[0][0] in "\"'" else re.sub(r"[^\n]", " ", match[0])
    return re.sub(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'|//[^\n]*|/\*.*?\*/', blank, text, flags=re.S)


class House:
    def __init__(self, root):
        self.root, self.rooms = root, house.table(root)
        self.wrong = []  # (where, what)

    def say(self, path, what, line=None):
        self.wrong.append((f"{path}: {what}", line))

    def files(self, *folders, kinds=(".h", ".cpp")):
        """(path from the root, text)"""
        for folder in folders:
            for path in sorted((self.root / folder).rglob("*")):
                if path.suffix in kinds and path.is_file():
                    yield path.relative_to(self.root).as_posix(), path.read_text()

    def includes(self):
        """(file, line, what stands between the quotes or brackets)"""
        for path, text in self.files(*self.rooms):
            for n, line in enumerate(text.splitlines(), 1):
                match = re.match(r'\s*#\s*include\s*["<]([^">]+)[">]', line)
                if match:
                    yield path, n, match[1]

    def check_arrows(self):
        """Each include goes along an arrow of the table, and each arrow of the table is needed."""
        page, used = "docs/source-layout.md", set()
        for path, n, included in self.includes():
            here, there = house.room_of(path, self.rooms), house.room_of(included, self.rooms)
            if there and there != here:
                used.add((here, there))
                if there not in self.rooms[here]:
                    self.say(path, f"includes {included}: the table allows no arrow {here} -> {there}", n)
            for start, owners in LIBRARIES.items():
                if re.match(start, included) and here not in owners:
                    self.say(path, f"includes {included}: that library belongs to {', '.join(owners)}", n)
        for here, allowed in self.rooms.items():
            if not (self.root / here / "CMakeLists.txt").exists():
                self.say(page, f"names the room {here}, which is not there")
            for there in allowed:
                if (here, there) not in used:
                    self.say(page, f"allows {here} -> {there}, which nothing uses")
        self.found("includes", used)

    def check_rules(self):
        """The arrows of the table run down only, and every folder with code is a room."""
        page = "docs/source-layout.md"
        floors = house.floors(self.rooms)
        for room, allowed in self.rooms.items():
            for other in allowed:
                if other not in self.rooms:
                    self.say(page, f"{room} may include {other}, which is no room")
            if room not in floors and not [o for o in allowed if o not in self.rooms]:
                self.say(page, f"{room} stands in or above a circle")
            for who, never, why in RULES:
                for other in sorted(house.below(room, self.rooms)):
                    if re.fullmatch(who, room) and re.fullmatch(never, other):
                        self.say(page, f"{room} reaches {other}, but {why}")
        for makefile in sorted([*self.root.glob("*/CMakeLists.txt"), *self.root.glob("analysis/*/CMakeLists.txt")]):
            folder = makefile.parent.relative_to(self.root).as_posix()
            if folder not in self.rooms and folder not in ("analysis", "tests", "build"):
                self.say(folder, f"is no room of the table in {page}")
        self.found("rooms", floors)

    def check_length(self):
        """No file is longer than one reads at a sitting."""
        seen = 0
        for path, text in self.files(*self.rooms, "tests", "docs", kinds=(".h", ".cpp", ".py", ".sh", ".ino")):
            seen += 1
            lines = text.count("\n")
            if lines > LONGEST_FILE:
                self.say(path, f"{lines} lines")
        self.found("files", seen)

    def check_functions(self):
        """No function is longer than a page. Universal Ctags knows where they begin and end."""
        sources = [path for path, _ in self.files(*self.rooms, "tests")]
        command = ["ctags", "-L", "-", "-f", "-", "--langmap=C++:.cpp.h", "--kinds-C++=f", "--fields=ne"]
        tags = subprocess.run(command, input="\n".join(sources), cwd=self.root, stdout=subprocess.PIPE, text=True, check=True)
        seen = 0
        for tag in tags.stdout.splitlines():
            name, path = tag.split("\t")[:2]
            begin, end = re.search(r"\tline:(\d+)", tag), re.search(r"\tend:(\d+)", tag)
            if begin and end:
                seen += 1
                lines = int(end[1]) - int(begin[1]) + 1
                if lines > LONGEST_FUNCTION:
                    self.say(path, f"{name}() has {lines} lines", int(begin[1]))
        self.found("functions", seen)

    def check_effects(self):
        """What is known of an effect lives with the effect: no id of one stands in a literal elsewhere."""
        ids = {name for _, text in self.files("model/effects") for name in re.findall(r'\.id = "(\w+)"', text)}
        seen = 0
        for path, text in self.files("analysis", "report", "tools"):
            seen += 1
            for n, line in enumerate(without_comments(text).splitlines(), 1):
                for literal in re.findall(r'"((?:[^"\\]|\\.)*)"', line):
                    for name in sorted(set(re.findall(r"\w+", literal)) & ids):
                        if "_" in name or literal.split(".")[0] == name:  # not the word `cogging` in a sentence
                            self.say(path, f"knows the effect `{name}`", n)
        self.found("effects", ids)
        self.found("sources that may not know them", seen)

    def check_pages(self):
        """A file that a page names is there, seen from the root or from the page."""
        seen = 0
        for path, text in [("README.md", (self.root / "README.md").read_text()), *self.files("docs", kinds=(".md",))]:
            for n, line in enumerate(text.splitlines(), 1):
                for name in re.findall(r"(?<![\w/.-])((?:[\w-]+/)+[\w-]+\.(?:h|cpp|py|sh|md|ino|svg|png))(?!\w)", line):
                    seen += 1
                    if name.startswith("build/"):  # made by a command beside it
                        continue
                    if not any((base / name).exists() for base in (self.root, (self.root / path).parent)):
                        self.say(path, f"names {name}, which is not there", n)
        self.found("files named on pages", seen)

    def found(self, what, number):
        number = number if isinstance(number, int) else len(number)
        if number == 0:
            self.say("house.py", f"found no {what}: nothing was checked")


CHECKS = ["arrows", "rules", "length", "functions", "effects", "pages"]


def wrong_with(root, checks):
    it = House(root)
    for check in checks:
        getattr(it, "check_" + check)()
    return it.wrong


# A house with one fault of each kind, and what is to be said of it.
MADE_UP = {
    "docs/source-layout.md": "| `hal/` | what | |\n| `model/` | it | `hal` |\n| `tools/` | all | `hal`, `daemon` |\n"
                             "| `daemon/` | round | `session` |\n| `session/` | about | `daemon`, `hal` |\n",
    "model/effects/shaft/windage.h": '// "windage"\nstatic constexpr EffectInfo info{.id = "windage"};\n',
    "README.md": "`hal/fault.h`, build/story/page.md, `hal/turn.h`\n",
    "hal/CMakeLists.txt": "",
    "model/CMakeLists.txt": "",
    "tools/CMakeLists.txt": "",
    "daemon/CMakeLists.txt": "",
    "attic/CMakeLists.txt": "",
    "hal/fault.h": '#include "model/model.h"\n',
    "model/model.h": '#include "hal/fault.h"\n#include <hdf5.h>\n',
    "tools/emtb.cpp": "int windy() {\n" + "  ;\n" * 80 + '  return name == "windage";  // as "windage" does\n}\n'
                      + "\n" * 420,
}
SAID = """
hal/fault.h:1: includes model/model.h: the table allows no arrow hal -> model
model/model.h:2: includes hdf5.h: that library belongs to session
docs/source-layout.md: names the room session, which is not there
docs/source-layout.md: allows tools -> hal, which nothing uses
docs/source-layout.md: allows tools -> daemon, which nothing uses
docs/source-layout.md: allows daemon -> session, which nothing uses
docs/source-layout.md: allows session -> daemon, which nothing uses
docs/source-layout.md: allows session -> hal, which nothing uses
docs/source-layout.md: daemon reaches daemon, but nothing imports daemon or tools
docs/source-layout.md: session reaches daemon, but nothing imports daemon or tools
docs/source-layout.md: tools reaches daemon, but nothing imports daemon or tools
docs/source-layout.md: daemon stands in or above a circle
docs/source-layout.md: session stands in or above a circle
docs/source-layout.md: tools stands in or above a circle
attic: is no room of the table in docs/source-layout.md
tools/emtb.cpp: 503 lines
tools/emtb.cpp:1: windy() has 83 lines
tools/emtb.cpp:82: knows the effect `windage`
README.md:1: names hal/turn.h, which is not there
"""


def as_printed(wrong):
    return [what if line is None else what.replace(":", f":{line}:", 1) for what, line in wrong]


def check_itself():
    with tempfile.TemporaryDirectory() as folder:
        for path, text in MADE_UP.items():
            file = pathlib.Path(folder) / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        said, expected = set(as_printed(wrong_with(pathlib.Path(folder), CHECKS))), set(SAID.strip().splitlines())
    for line in sorted(said - expected):
        print(f"said of the made-up house, and should not have been: {line}")
    for line in sorted(expected - said):
        print(f"not said of the made-up house: {line}")
    return said == expected


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("check", nargs="?", choices=CHECKS + ["itself"])
    parser.add_argument("--root", type=pathlib.Path, default=house.ROOT)
    given = parser.parse_args()
    if given.check == "itself":
        return 0 if check_itself() else 1
    wrong = wrong_with(given.root, [given.check] if given.check else CHECKS)
    allowed = set(NOT_YET.strip().splitlines())
    kinds = [re.sub(r"\d+ lines", "N lines", what) for what, _ in wrong]
    for kind, line in zip(kinds, as_printed(wrong)):
        print(("to be mended: " if kind in allowed else "WRONG: ") + line)
    if not given.check:
        for line in sorted(allowed - set(kinds)):
            print(f"mended, to be taken from the list in house.py: {line}")
    return 1 if set(kinds) - allowed else 0


if __name__ == "__main__":
    sys.exit(main())
