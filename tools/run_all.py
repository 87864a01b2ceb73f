#!/usr/bin/env python3
"""`trundle run` over every real recording, and a table of the errors before and after.

usage: tools/run_all.py PROGRAM DATA OUT [RESULTS.md]

Lays recording folders over DATA (tools/*_recordings.py), then runs each session of a robot in one go: with the robot as
its owners assumed it, calibrated on another session where there is one. Prints a table in Markdown and writes it between
the marks in RESULTS.md, with the date and this command. Errors are those of positions against the recording's
reference, from a common start; of several recordings the median and, in brackets, the worst.
"""
import csv
import datetime
import json
import math
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- run_all: begin -->", "<!-- run_all: end -->"
LONGEST_S = 1800
# Such rows show what a gyro would add; they are no evidence of a real one's accuracy.
GYRO_MADE = " (gyro made from the reference)"


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def warthog_continuous(data, out):
    """A whole log of the skid-steer robot: the lidar's pose comes at 10 Hz and is repeated in between."""
    folder = out / "warthog_whole"
    for file in sorted((data / "warthog_drive").glob("continuous_*.csv")):
        wheels, gyro, reference = ["time_s,left_rad_s,right_rad_s"], ["time_s,yaw_rate_rad_s"], ["time_s,x_m,y_m,heading_rad"]
        with open(file, newline="") as lines:
            rows = list(csv.DictReader(lines))
        origin, index = int(rows[0]["ros_time"]), None
        for row in rows:
            t = f"{(int(row['ros_time']) - origin) / 1e9:.9f}"
            wheels.append(f"{t},{row['meas_left_vel']},{row['meas_right_vel']}")
            gyro.append(f"{t},{row['imu_z']}")
            if row["icp_index"] != index:
                x, y, z, w = (float(row[f"icp_quat_{axis}"]) for axis in "xyzw")
                yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
                reference.append(f"{t},{row['icp_pos_x']},{row['icp_pos_y']},{yaw!r}")
            index = row["icp_index"]
        for name, lines in (("wheels", wheels), ("gyro", gyro), ("reference", reference)):
            write(folder / "continuous" / f"{name}.csv", "\n".join(lines) + "\n")


def husky(data, out):
    """Wheel odometry as the driver computed it, the gyro of an IMU on its side, GPS as positions without headings."""
    source, target = (data / "husky_gps_bag").resolve(), out / "husky_gps_bag"
    write(target / "robot.toml", 'name = "husky"\n[gyro]\nnoise_rad_s_sqrt_hz = 0.002\nbias_sigma_rad_s = 0.02\n'
                                 '[noise]\nwheel_per_sqrt_m = 0.05\nturn_per_sqrt_m = 0.05\nturn_per_sqrt_rad = 0.1\n')
    with open(source / "fix.csv", newline="") as lines:
        fixes = [row for row in csv.DictReader(lines) if row["status"] != "-1"]
    lat, lon = math.radians(float(fixes[0]["lat_deg"])), math.radians(float(fixes[0]["lon_deg"]))
    reference = "time_s,x_m,y_m\n" + "".join(
        f"{row['stamp']},{6378137 * math.cos(lat) * (math.radians(float(row['lon_deg'])) - lon)!r},"
        f"{6378137 * (math.radians(float(row['lat_deg'])) - lat)!r}\n" for row in fixes)
    write(target / "drive/reference.csv", reference)
    write(target / "drive/recording.toml",
          f'[velocity]\nfile = "{source}/husky_velocity_controller_odom.csv"\ncolumns.time_s = "stamp"\n'
          'columns.forward_m_s = "vx"\ncolumns.yaw_rate_rad_s = "wz"\n'
          f'[gyro]\nfile = "{source}/imu_data.csv"\ncolumns.time_s = "stamp"\ncolumns.yaw_rate_rad_s = "wy"\n')


def lay_out(data, out):
    for tool, folder in (("real", out), ("slip", out / "slip"), ("slam", out / "slam")):
        subprocess.run([sys.executable, HERE / f"{tool}_recordings.py", data, folder], check=True)
    subprocess.run([sys.executable, HERE / "warthog_recordings.py", data, out / "warthog"], check=True)
    warthog_continuous(data, out)
    write(out / "warthog_whole/robot.toml", (out / "warthog/robot.toml").read_text())
    husky(data, out)


class Job:
    """One call of `trundle run`."""

    def __init__(self, title, folder, robot, calibrate_on=None, options=()):
        self.title, self.folder, self.robot = title, folder, robot
        self.calibrate_on, self.options = calibrate_on, list(options)


def sessions(out, name, train, train_of_train, remark=""):
    """Each session, calibrated on another: `train`, which itself is calibrated on `train_of_train`. The remark is for the row."""
    base = out / name
    for folder in sorted(path for path in base.glob("*/*") if path.is_dir()):
        on = train if folder != base / train else train_of_train
        yield Job(f"{name}/{folder.relative_to(base)}{remark}", folder, base / "robot.toml", on and base / on)


def jobs(data, out):
    yield from sessions(out, "optiodom_diff", "square/231220200040", "square/231220200029")
    yield from sessions(out, "optiodom_omni3", "circular/221220201643", "circular/221220201716")
    yield from sessions(out, "optiodom_omni3_gyro", "circular/221220201643", "circular/221220201716", GYRO_MADE)
    yield from sessions(out, "optiodom_omni4", "circular/231220200346", None)
    for folder in sorted((out / "censi_calibration").glob("lmov*")):
        yield Job(f"censi_calibration/{folder.name}", folder, out / "censi_calibration/robot.toml", None,
                  ["--free", "reference.x", "--free", "reference.y", "--free", "reference.heading"])
    kobuki = out / "slip/kobuki_slip"
    for name in ("nonfaulty_2", "left_faulty", "right_faulty"):
        yield Job(f"kobuki_slip/{name}", kobuki / name, kobuki / "robot.toml", None, ["--learn", str(kobuki / "nonfaulty_1")])
    for folder in sorted((out / "ese650_skidsteer").glob("encoders*")):
        yield Job(f"ese650_skidsteer/{folder.name}", folder, out / "ese650_skidsteer/robot.toml")
    yield Job("warthog_drive/continuous (asphalt)", out / "warthog_whole/continuous", out / "warthog_whole/robot.toml",
              out / "warthog/asphalt/train")
    for surface in ("asphalt", "gravel", "ice"):
        base = out / "warthog"
        yield Job(f"warthog_drive/{surface}, windows of 2 s", base / surface / "test", base / "robot.toml", base / surface / "train")
    yield Job("husky_gps_bag", out / "husky_gps_bag/drive", out / "husky_gps_bag/robot.toml")
    for number in range(1, 6):
        yield Job(f"mrclam/robot {number}", data / "mrclam/MRCLAM_Dataset6", out / "slam/mrclam/robot.toml", None,
                  ["--robot-number", number])
    for name in ("lost_in_the_woods", "victoria_park"):
        yield Job(name, out / "slam" / name, out / "slam" / name / "robot.toml")


def read(path):
    return json.loads(path.read_text()) if path.exists() else None


def results_below(folder):
    """The folders of single recordings in the result of a run."""
    document = read(folder / "run.json")
    if document is None:
        return []
    return [folder / name for name in document["recordings"]] if "recordings" in document else [folder]


def errors_of(folder):
    """rms of each trajectory of a result."""
    evaluation = read(folder / "evaluation.json")
    if evaluation is None:
        return {}
    kind = evaluation["alignment"]["kind"]
    return {one["name"]: one["evaluations"][kind]["position_m"]["rms"]
            for one in evaluation["trajectories"] if kind in one["evaluations"]}


def not_numbers(folder):
    """Files of a result in which something is no number."""
    return [str(path) for path in folder.rglob("*") if path.suffix in (".csv", ".json", ".toml")
            and any(word in path.read_text().lower() for word in (",nan", ": nan", "= nan", ",inf", ",-inf", ": inf", "= inf"))]


def text_of(errors):
    if not errors:
        return "–"
    if len(errors) == 1:
        return f"{errors[0]:.4f}"
    return f"{statistics.median(errors):.4f} ({max(errors):.4f})"


# What has nothing to be compared with still has something to say.
def told(folder):
    document = read(folder / "run.json")
    stages = {stage["name"]: stage for stage in document["stages"] if stage["name"] not in document.get("recordings", [])}
    words = []
    calibration = stages.get("calibration")
    if calibration and calibration["status"] == "done" and not document["held_out"]:
        words.append(calibration["message"])
    for name, stage in stages.items():
        if stage["status"] == "failed":
            words.append(f"{name}: {stage['message']}")
    return words


def remarks_of(folder):
    """What is printed below the stages, each sentence once, without the paths of the files."""
    remarks = []
    for one in {folder, *results_below(folder)}:
        for stage in read(one / "run.json")["stages"]:
            remarks += [re.sub(r"^(\w+: )\S*/", r"\1", remark) for remark in stage["remarks"]]
    return sorted(set(remarks), key=lambda remark: (not remark.startswith("warning"), remark))


def converged(folder):
    calibration = read(folder / "calibration.json")
    if calibration is None:
        return "–"
    return "no" if any("optimizer stopped" in words for words in calibration["warnings"]) else "yes"


def clocks_of(folder):
    """Offsets that were found and corrected: "gyro -0.0498"."""
    said = " ".join(remarks_of(folder))
    return ", ".join(f"{sensor} {offset}" for sensor, offset in
                     sorted(set(re.findall(r"corrected: (\w+)\.time_offset_s (-?[\d.]+(?: to -?[\d.]+)?)", said)))) or "–"


def told_of(folder):
    words = told(folder) + remarks_of(folder)
    singles = results_below(folder)
    slip = [read(one / "slip.json") for one in singles]
    shares = [s["intervals"]["flagged_share"] for s in slip if s and s["intervals"]["judged"]]
    if shares:
        words.append(f"slip in {100 * statistics.median(shares):.1f} % of moving intervals")
    counts = {}
    for one in singles if singles != [folder] else []:
        for word in told(one):
            counts[word.split(":")[0]] = counts.get(word.split(":")[0], 0) + 1
    words += [f"{name} impossible in {n} of {len(singles)}" for name, n in counts.items()]
    return "; ".join(words)


def row_of(job, program, out):
    target = out / "results" / job.title.replace(", ", "_").replace(" ", "_")
    command = [program, "run", job.folder, "--robot", job.robot, "-o", target, "--quiet", *job.options]
    if job.calibrate_on:
        command += ["--calibrate-on", job.calibrate_on]
    start = time.time()
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=LONGEST_S)
        code, said = done.returncode, done.stderr.strip()
    except subprocess.TimeoutExpired:
        code, said = "none", f"not done after {LONGEST_S} s"
    spent = time.time() - start
    print(f"  {job.title}: exit {code}, {spent:.1f} s {said}", file=sys.stderr, flush=True)
    document = read(target / "run.json")
    if document is None:
        return [job.title, *["–"] * 9, str(code), said], code not in (0, 4)
    singles = [errors_of(folder) for folder in results_below(target)]
    column = lambda *names: text_of([next(e[n] for n in names if n in e) for e in singles if any(n in e for n in names)])
    held_out = {True: "yes", False: "no", None: "–"}[document["held_out"]]
    bad = not_numbers(target)
    words = [said] if said else []
    words += [told_of(target).replace(f"{out}/", "")] + [f"NOT A NUMBER in {name}" for name in bad]
    row = [job.title, str(len(singles)), held_out, converged(target), clocks_of(target), column("nominal", "odometry"), column("odometry"), column("corrected"),
           column("slam online"), column("slam"), str(code), "; ".join(word for word in words if word)]
    return row, bool(bad) or code not in (0, 4)


def table_of(rows):
    head = ["recordings", "runs", "held out", "converged", "clock offsets corrected [s]", "robot as given [m]", "calibrated [m]", "slips corrected [m]", "mapped, online [m]", "mapped, smoothed [m]", "exit", "it says"]
    lines = [head, ["---"] * len(head)] + [[cell.replace("|", "/") for cell in row] for row in rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def put(path, text):
    """Between the marks of a page, or at its end."""
    page = path.read_text() if path.exists() else ""
    if BEGIN not in page:
        page = page.rstrip("\n") + f"\n\n{BEGIN}\n{END}\n"
    head, rest = page.split(BEGIN)
    path.write_text(head + BEGIN + "\n" + text + END + rest.split(END)[1])


def main():
    program, data, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
    lay_out(data, out)
    rows, bad = [], False
    for job in jobs(data, out):
        row, wrong = row_of(job, program, out)
        rows.append(row)
        bad = bad or wrong
    version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.strip()
    table = table_of(rows)
    print(table)
    if len(sys.argv) > 4:
        put(Path(sys.argv[4]), f"Made on {datetime.date.today()} by `tools/run_all.py build/trundle ../shared/data out/all "
                               f"docs/results/real-recordings.md` ({version}).\n\n" + table)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    main()
