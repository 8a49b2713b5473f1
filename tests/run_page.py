"""Runs the blocks of one page in order, in the current folder: `python run_page.py STEPS.json`.

test_docs.py writes the file: `page` is the page's path, `steps` a list of [kind, line, text] with the line of the
opening fence. The kinds are those of KINDS. Blocks of Python share a namespace, like cells of a notebook. `target` in
the folder is a link to the checkout's. A block that fails ends the program with its text and the reason.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

# Accepted relative difference of a page's numbers, which other machines round differently. Below 1e-3 the accepted
# difference is 1e-6, that of the number 1e-3.
RTOL = 1e-3
# Words that mark lines of output that change from run to run. Such lines are not compared.
VARIES = re.compile(r"seconds|origin|adapter|version")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")

# Arguments of compilers for the C library of the last build; `target` is relative to the current folder.
C_FLAGS = ["-Wall", "-Wextra", "-Werror", "-I", "target/c_abi/include"]
C_LINK = ["-L", "target/c_abi/lib", "-lsunbeam", "-Wl,-rpath,target/c_abi/lib", "-lpthread", "-lm"]
# Compilers by language.
COMPILERS = {"c": ["cc", "-std=c11"], "cpp": ["c++", "-std=c++17"]}

# Names that blocks of Python have defined.
namespace = {"__name__": "__main__"}


def shell(text, *options, check=True):
    """Runs commands by Bash with `options`, prints their output and returns it, with that on stderr at the end.

    Fails for an exit status other than 0 if `check` is true.
    """
    done = subprocess.run(["bash", *options, "-c", text], capture_output=True, text=True)
    print(done.stdout + done.stderr, flush=True)
    if check and done.returncode:
        raise AssertionError(f"exit status {done.returncode}")
    return done.stdout + done.stderr


def commands(text):
    """Pairs of a command and the lines of its output on the page. The text begins with a command, after "$ ".

    A command continues after a backslash or a pipe.
    """
    pairs, goes_on = [], False
    for line in text.splitlines():
        if goes_on:
            pairs[-1][0] += "\n" + line
        elif line.startswith("$ "):
            pairs.append([line[2:], []])
        else:
            pairs[-1][1].append(line)
            continue
        goes_on = line.endswith(("\\", "|"))
    return pairs


def compare(shown, found):
    """Fails where a command's output differs from the page's beyond rounding. A line of … stands for the rest."""
    found = found.splitlines()
    for number, line in enumerate(shown):
        if line == "…":
            return
        assert number < len(found), f"the page shows more than there is: {line}"
        if VARIES.search(line):
            continue
        same_words = NUMBER.sub("#", line) == NUMBER.sub("#", found[number])
        pairs = zip(map(float, NUMBER.findall(line)), map(float, NUMBER.findall(found[number])))
        if not same_words or any(abs(a - b) > RTOL * max(abs(a), abs(b), 1e-3) for a, b in pairs):
            raise AssertionError(f"the page shows\n  {line}\nbut it is\n  {found[number]}")
    assert len(found) == len(shown), f"the page does not show {found[len(shown)]}"


def run_console(text, _line):
    """Runs the commands and compares their outputs. A command whose shown output ends with `sunbeam: …` may fail."""
    for command, shown in commands(text):
        refused = bool(shown) and shown[-1].startswith("sunbeam: ")
        found = shell(command, "-eu", check=not refused)
        if shown:
            compare(shown, found)


def run_c(language, text, line):
    """Compiles C or C++, and runs it if it has a `main`. A comment at the start may name the file."""
    named = re.match(r"(?:/\*|//) (\S+\.(?:c|cpp))\b", text)
    source = Path(named[1] if named else f"block-{line}.{language}")
    source.write_text(text)
    compiler = [*COMPILERS[language], *C_FLAGS, str(source)]
    if re.search(r"\bmain\s*\(", text):
        program = f"./{source.stem}-{language}"
        execute([*compiler, "-o", program, *C_LINK])
        execute([program])
    else:
        execute([*compiler, "-fsyntax-only"])


def execute(words):
    """Runs a program with arguments and prints its output. Fails for an exit status other than 0."""
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(done.stdout, flush=True)
    assert done.returncode == 0, f"{words[0]}: exit status {done.returncode}"


def run_xml(text, _line):
    """Loads a scene in Mitsuba with the plugin, or a part of a scene inside a shape."""
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_spectral")
    if "target/mitsuba" not in [str(folder) for folder in mi.file_resolver()]:
        mi.file_resolver().append("target/mitsuba")
    if "<scene" not in text:
        text = f'<scene version="3.0.0"><shape type="rectangle">{text}</shape></scene>'
    mi.load_string(text)


def run_json(text, _line):
    """Parses one document, or one in each line."""
    try:
        json.loads(text)
    except json.JSONDecodeError:
        for line in text.splitlines():
            json.loads(line)


def run_toml(text, _line):
    """Parses a document."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    tomllib.loads(text)


def run_python(text, line):
    """Runs Python in the shared namespace."""
    # Tracebacks show the page's line numbers: the text begins in the line after the fence.
    exec(compile("\n" * line + text, PAGE, "exec"), namespace)


# Functions of the text and the line that run a block, by its kind.
KINDS = {
    "python": run_python,
    "sh": lambda text, _line: shell(text, "-euo", "pipefail"),
    "console": run_console,
    "c": lambda text, line: run_c("c", text, line),
    "cpp": lambda text, line: run_c("cpp", text, line),
    "xml": run_xml,
    "json": run_json,
    "toml": run_toml,
}

if __name__ == "__main__":
    task = json.loads(Path(sys.argv[1]).read_text())
    # Path of the page.
    PAGE = task["page"]
    for kind, line, text in task["steps"]:
        try:
            KINDS[kind](text, line)
        except BaseException as error:
            print(f"\n{PAGE}:{line}: {kind}:\n{text}", flush=True)
            # An assertion needs no traceback. A block that exits, even with status 0, would skip the blocks after it.
            if not isinstance(error, (AssertionError, SystemExit)):
                raise
            sys.exit(str(error))
