#!/usr/bin/env python3
"""Holds the commands that pages show and no test runs to what there is.

    named.py --build DIR

They need root, hours, hardware, a network or data that do not come with emtb. What they name has to be there all the same: the
commands and options of emtb and emtbd, presets, targets, labels of tests, scripts and their options, files of the sources.
"""
import argparse
import json
import pathlib
import re
import shlex
import subprocess
import sys

from run_pages import ROOT, blocks

PAGES = ["README.md", "CONTRIBUTING.md", *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md"))]
OURS = ("tests/", "tools/", "config/", "docs/", "python/")


def said(*words):
    return subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout


class There:
    """What there is in a build."""

    def __init__(self, build):
        self.build, self.helps = build, {}
        self.presets = {p["name"] for p in json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]}
        self.targets = set(re.findall(r"^(\S+): ", said("cmake", "--build", build, "--target", "help"), flags=re.M))

    def help_of(self, program, command=""):
        """The text that names all options: of a command of emtb those of all of them as well."""
        if (program, command) not in self.helps:
            words = [program, "help", command] if command else [program, "--help"]
            self.helps[program, command] = said(self.build / "bin" / words[0], *words[1:])
        return self.helps[program, command]

    def wrong_options(self, words, text):
        for word in words:
            name = word.split("=")[0]
            if name.startswith("--") and name != "--" and not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", text):
                yield f"the option {name}"

    def wrong_of_emtb(self, words):
        rest = list(words)
        while rest and rest[0].startswith("--"):
            rest = rest[2:]
        if not rest or rest[0] not in re.findall(r"^  (\S+)", self.help_of("emtb"), flags=re.M):
            return [f"the command {' '.join(rest[:1])}"]
        return self.wrong_options(words, self.help_of("emtb", rest[0]) + self.help_of("emtb"))

    def wrong_of_build(self, words):
        for option, value in zip(words, words[1:]):
            if option == "--preset" and value not in self.presets:
                yield f"the preset {value}"
            if option == "--target" and value not in self.targets:
                yield f"the target {value}"

    def wrong_of_ctest(self, words):
        yield from self.wrong_of_build(words)
        for option, value in zip(words, words[1:]):
            if option == "-L" and "Total Tests: 0" in said("ctest", "--test-dir", self.build, "-N", "-L", value):
                yield f"a test with the label {value}"

    def wrong_of_file(self, words):
        program = words[0].removeprefix("./")
        if program.startswith("build/env/"):
            return  # made by the lines of its page
        if program.startswith("build/"):
            if pathlib.Path(program).name not in self.targets:
                yield f"the program {program}"
        elif not (ROOT / program).is_file():
            yield f"the program {program}"
        else:
            yield from self.wrong_options(words, (ROOT / program).read_text())

    def wrong_of(self, words):
        """What a command names that is not there."""
        kinds = {"emtb": lambda: self.wrong_of_emtb(words[1:]), "cmake": lambda: self.wrong_of_build(words),
                 "emtbd": lambda: self.wrong_options(words, self.help_of("emtbd")), "ctest": lambda: self.wrong_of_ctest(words)}
        if words[0] in kinds:
            yield from kinds[words[0]]()
        elif words[0].startswith(("./", "build/", *OURS)):
            yield from self.wrong_of_file(words)
        for word in words[1:]:
            path = word.removeprefix("./").split("@")[0].split("#")[0]
            if path.startswith(OURS) and not re.search(r"[*{}$]", path) and not (ROOT / path).parent.exists():
                yield f"the folder of {path}"
            elif path.startswith("config/") and path.endswith(".yaml") and not (ROOT / path).exists():
                yield f"the file {path}"


def commands_of(block):
    """The words of each command of a block, as far as a shell needs no variables for them."""
    for line in block.replace("\\\n", " ").splitlines():
        try:
            words = shlex.split(re.sub(r"\[|\]", " ", line), comments=True)
        except ValueError:  # a part of a longer word, over lines
            continue
        command = []
        for word in [*words, ";"]:
            if word.rstrip(";") in ("", "&&", "||", "&", "|") or word in ("do", "done"):
                if command:
                    yield command
                command = []
            elif word.endswith(";"):
                yield [*command, word[:-1]]
                command = []
            else:
                command.append(word)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    given = parser.parse_args()
    there, count, wrong = There(given.build.resolve()), 0, []
    for page in PAGES:
        for line, kind, block in blocks((ROOT / page).read_text()):
            if kind not in ("", "text", "sh"):
                continue
            for words in commands_of(block):
                count += words[0] in ("emtb", "emtbd", "cmake", "ctest") or words[0].startswith(("./", "build/", *OURS))
                wrong += [f"{page}:{line}: `{' '.join(words)}`: {what} is not there" for what in there.wrong_of(words)]
    for one in wrong:
        print("WRONG:", one)
    print(f"{count} commands were looked at")
    return 1 if wrong or count < 120 else 0


if __name__ == "__main__":
    sys.exit(main())
