"""What the tests of the package share: what was found wrong so far, and programs that are run."""
import subprocess

wrong = []


def check(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what, flush=True)


def run(*words, **more):
    return subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
