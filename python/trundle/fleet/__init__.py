"""Many logs of many robots: calibration, health, slip and odometry of each, and what a fleet shows that one robot
does not. `python3 -m trundle.fleet` is the program; docs/fleet.md.

logs -> store -> worker (host, work) -> engine -> statistics (population, drift, outliers, needs) -> page
"""
