"""What Python adds is small: to start, and to each call."""

import subprocess
import sys
import time
import unittest

import numpy
import trundle
from common import ROBOT

_TRIES = 7  # of which the fastest counts: the machine has other things to do


def fastest(call):
    times = []
    for _ in range(_TRIES):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


class Speed(unittest.TestCase):
    def test_import(self):
        code = "import time; start = time.process_time(); import trundle; print(time.process_time() - start)"
        seconds = min(float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
                      for _ in range(_TRIES))
        print(f"import: {seconds:.3f} s of processor time")
        self.assertLess(seconds, 0.3)

    def test_what_is_slow_to_import_is_not_imported(self):
        code = ("import sys, trundle\n"
                "trundle.odometry('data/demo/session_03/tour', 'data/demo/robot.toml').to_dict()\n"
                "print([name for name in ('pandas', 'matplotlib') if name in sys.modules])")
        self.assertEqual(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout, "[]\n")

    def test_a_call_on_a_minute(self):
        time_s = numpy.arange(0.0, 60.0, 0.02)
        ticks = numpy.round(time_s * 300.0)
        minute = trundle.Recording.from_arrays(
            wheels={"time_s": time_s, "left_ticks": ticks, "right_ticks": ticks},
            gyro={"time_s": time_s, "yaw_rate_rad_s": numpy.zeros_like(time_s)})
        robot = trundle.Robot(ROBOT)
        whole = fastest(lambda: trundle.odometry(minute, robot))
        found = trundle.odometry(minute, robot)

        def look():
            t = found.trajectory
            return t.time_s, t.x_m, t.y_m, t.heading_rad, t.covariance

        # A call that has next to nothing to compute costs what Python and the binding do, the result included.
        instant = trundle.Recording.from_arrays(wheels={name: values[:3] for name, values in minute.wheels.items()})
        self.assertEqual(len(trundle.odometry(instant, robot).trajectory), 3)
        overhead = fastest(lambda: trundle.odometry(instant, robot))
        print(f"odometry of a minute at 50 Hz: {1e3 * whole:.2f} ms, of which {1e3 * overhead:.3f} ms are the call; "
              f"its arrays: {1e3 * fastest(look):.3f} ms")
        self.assertLess(overhead + fastest(look), 2e-3)


if __name__ == "__main__":
    unittest.main()
