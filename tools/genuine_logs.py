#!/usr/bin/env python3
"""genuine_logs.py PROGRAM DATA [PAGE]: what `info`, `init` and `run` say of other people's logs, as they are.

For each log below DATA/logs, and the bag of DATA/husky_gps_bag, the commands that a newcomer gives: `info LOG`, `init LOG`,
and what `init` names as the next step, if that is `run`. Prints a table, or writes it into PAGE between its marks. All that
was said stays in out/genuine_logs.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys

MARKS = "<!-- genuine_logs: begin -->\n", "<!-- genuine_logs: end -->"
STAGES = ("calibration", "odometry", "slip", "evaluation")


def said(program, folder, name, *arguments):
    """Exit code and output of a command, which is kept."""
    done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600)
    (folder / f"{name}.txt").write_text(done.stdout + done.stderr)
    return done.returncode, done.stdout + done.stderr


def info_words(code, text, document):
    if code:
        return text.strip().splitlines()[-1]
    head = text.splitlines()[0].split(": ", 1)[1]
    words = [f"{head}; {len(document['topics'])} topic{'s' * (len(document['topics']) != 1)}"]
    unread = [topic["topic"] for topic in document["topics"] if topic.get("unreadable") and topic["messages"]]
    if unread:
        words.append(f"no definition of {', '.join(unread)}")
    if document.get("cut"):
        words.append(f"cut: {document['cut']['reason']}")
    return "; ".join(words)


def init_words(text):
    lines = [re.sub(r":? from .*", "", line) for line in text.splitlines() if re.match(r"(wheels|gyro|velocity|reference|sightings):", line)]
    missing = re.search(r"to fill in:\n((?:  .*\n)+)", text)
    words = ", ".join(lines) or "nothing recognised"
    return words + ("; to fill in: " + "; ".join(line.strip() for line in missing[1].splitlines()) if missing else "; no edit")


def run_words(folder):
    record = json.loads((folder / "run.json").read_text())
    stages = {stage["name"]: stage for stage in record["stages"]}
    return "; ".join(f"{name}: {'' if stages[name]['status'] == 'done' else stages[name]['status'] + ': '}{stages[name]['message']}"
                     for name in STAGES if name in stages)


def row_of(program, log, kept):
    folder = kept / log.name
    folder.mkdir(parents=True)
    info_code, info = said(program, folder, "info", "info", str(log))
    document = json.loads(subprocess.run([program, "info", str(log), "--json"], capture_output=True, text=True).stdout or "{}")
    init_code, init = said(program, folder, "init", "init", str(log), "-o", str(folder / "draft"))
    row = [log.name, f"{info_code}: {info_words(info_code, info, document)}", f"{init_code}: {init_words(init)}"]
    if re.search(r"^next: trundle run", init, re.M):
        draft = folder / "draft"
        run_code, run = said(program, folder, "run", "run", str(draft), "--robot", str(draft / "robot.toml"), "-o", str(folder / "out"))
        done = (folder / "out/run.json").exists()
        row.append(f"{run_code}: {run_words(folder / 'out') if done else run.strip().splitlines()[-1]}")
    else:
        row.append("– " + re.sub(r"next: ", "", init.strip().splitlines()[-1]).replace(str(folder), "."))
    return [cell.replace("|", "\\|").replace(str(log.parent) + "/", "").replace(str(folder) + "/", "") for cell in row]


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2])
    kept = pathlib.Path("out/genuine_logs")
    shutil.rmtree(kept, ignore_errors=True)
    logs = [path for path in sorted((data / "logs").iterdir()) if path.suffix != ".txt"] + [data / "husky_gps_bag/test1.bag"]
    table = ["| log | info | init | run |", "| --- | --- | --- | --- |"]
    table += ["| " + " | ".join(row_of(program, log, kept)) + " |" for log in logs if log.exists()]
    text = "\n".join(table) + "\n"
    if len(sys.argv) < 4:
        print(text, end="")
        return
    page = pathlib.Path(sys.argv[3])
    head, rest = page.read_text().split(MARKS[0])
    page.write_text(head + MARKS[0] + text + MARKS[1] + rest.split(MARKS[1])[1])


main()
