#!/usr/bin/env python3
"""How large the house is, as one table: tools/sizes.py [--build] [REVISION ...]

For each git revision, and for the working tree: sizes of files, functions and classes, constants, decisions that depend
on text, public headers, words of the docs. With --build also the processor time of cold builds (working tree alone).
"""
import io
import os
import re
import statistics
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(subprocess.check_output(["git", "rev-parse", "--show-toplevel"], text=True).strip())

# What reads files of others and the command line decides by the words that stand there.
READERS = r"^apps/|toml|/io/|trundle/logs/|recording/(csv|logs|streams|recording_map)|urdf|read_results|live_line"


def files_of(revision):
    """{path: text} of a revision; of the working tree where it is None."""
    if revision is None:
        names = subprocess.check_output(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, text=True).split("\n")
        paths = [ROOT / name for name in names if name]
        return {str(p.relative_to(ROOT)): p.read_text(errors="replace") for p in paths if p.is_file()}
    archive = subprocess.check_output(["git", "archive", "--format=tar", revision], cwd=ROOT)
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        return {m.name: tar.extractfile(m).read().decode(errors="replace") for m in tar if m.isfile()}


def without_comments(text):
    return re.sub(r'//[^\n]*|/\*.*?\*/', "", text, flags=re.S)


def bodies(text, opening):
    """What stands between the braces that follow each match of `opening`."""
    for match in re.finditer(opening, text):
        depth, at = 1, match.end()
        while depth and at < len(text):
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            at += 1
        yield match, text[match.end():at - 1]


def functions_of(text):
    """Lines of each function that is defined at the margin."""
    return [body.strip().count("\n") + 1
            for _, body in bodies(without_comments(text), r"(?m)^[A-Za-z_][^\n;{}#]*\([^;{}]*\)[^;{}()]*\{")]


def members_of(body):
    """Data members of a class: names that end in an underscore, and are declared at its own level."""
    flat = re.sub(r"\{[^{}]*\}", "", body)
    while flat != (flatter := re.sub(r"\{[^{}]*\}", "", flat)):
        flat = flatter
    return len(re.findall(r"(?m)^\s+[A-Za-z_:][^();]*\b[a-z0-9_]+_(?:\s*=[^;]*)?;", flat))


def share(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def public_headers(files):
    """Those that src/trundle/CMakeLists.txt names, if it names any."""
    named = re.search(r"(?m)^trundle_public_headers\(([^)]*)\)", files.get("src/trundle/CMakeLists.txt", ""))
    return named.group(1).split() if named else []


def installed_headers(files):
    """The public ones and what they include; all outside of detail/ where none are named."""
    queue, seen = public_headers(files), set()
    if not queue:
        return {p for p in files if re.match(r"src/.*\.hpp$", p) and "/detail/" not in p}
    while queue:
        header = queue.pop()
        if header not in seen:
            seen.add(header)
            queue += re.findall(r'(?m)^#include "(trundle/[^"]+)"', files.get("src/" + header, ""))
    return seen


def sizes_of(files):
    code = {p: t for p, t in files.items() if re.match(r"(src|apps)/.*\.(cpp|hpp|inl)$", p)}
    lines = [t.count("\n") for t in code.values()]
    functions = [n for t in code.values() for n in functions_of(t)]
    classes = {m.group(1): members_of(b) for p, t in code.items() if p.endswith(".hpp")
               for m, b in bodies(without_comments(t), r"\n(?:class|struct) (\w+)[^;{}()]*\{")}
    largest = max(classes, key=classes.get)
    constants = [(lines_before, line) for p, t in code.items() if p.endswith(".cpp")
                 for lines_before, line in zip([""] + t.split("\n"), t.split("\n"))
                 if re.match(r"\s*constexpr .*\bk[A-Z]\w* = [-0-9.]", line)]
    unexplained = [line for before, line in constants if "//" not in line and "//" not in before]
    steered = [m for p, t in code.items() if not re.search(READERS, p)
               for m in re.findall(r'(?:kind|stage|name|message|status|what)\b\)? ?[!=]= "', t)]
    headers = installed_headers(files)
    public = public_headers(files)
    pages = {p: len(t.split()) for p, t in files.items() if re.match(r"docs/.*\.md$", p)}
    user = {p: n for p, n in pages.items() if not re.match(r"docs/(theory|results)/", p)}
    longest = max(pages, key=pages.get)
    return {
        "files of code: number": len(lines),
        "lines of code": sum(lines),
        "lines of a file: median, 95 %, most": f"{statistics.median(lines):.0f}, {share(lines, .95)}, {max(lines)}",
        "functions: number": len(functions),
        "lines of a function: median, 95 %, most":
            f"{statistics.median(functions):.0f}, {share(functions, .95)}, {max(functions)}",
        "members of the largest class": f"{classes[largest]} ({largest})",
        "headers: installed": len(headers),
        "headers: public": len(public or headers),
        "constants in sources": len(constants),
        "of them without a word of explanation": len(unexplained),
        "decisions that depend on text, but for readers": len(steered),
        "words of the docs for users": sum(user.values()),
        "words of the docs in all": sum(pages.values()),
        "words of the longest page": f"{pages[longest]} ({longest.removeprefix('docs/')})",
    }


def build_minutes():
    """CPU minutes of cold builds, of all jobs together: what `./run demo` compiles, then what `./run test` does."""
    with tempfile.TemporaryDirectory() as folder:
        def minutes(*command):
            before = os.times()
            subprocess.run(["cmake", *command], cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
                           env={**os.environ, "CCACHE_DISABLE": "1"})
            after = os.times()
            return (after.children_user + after.children_system - before.children_user - before.children_system) / 60
        minutes("--preset", "release", "-B", folder)
        return {"CPU minutes to compile the program, for the demo": f"{minutes('--build', folder, '--target', 'trundle_app'):.1f}",
                "CPU minutes to compile the rest: tests, benches, examples": f"{minutes('--build', folder):.1f}"}


def main():
    build = "--build" in sys.argv
    revisions = [revision for revision in sys.argv[1:] if revision != "--build"] + [None]
    columns = [sizes_of(files_of(revision)) for revision in revisions]
    if build:
        columns[-1].update(build_minutes())
    names = [revision or "now" for revision in revisions]
    print("| |" + "|".join(f" {name} " for name in names) + "|")
    print("|---|" + "---|" * len(names))
    for row in columns[-1]:
        print(f"| {row} |" + "|".join(f" {column.get(row, '')} " for column in columns) + "|")


if __name__ == "__main__":
    main()
