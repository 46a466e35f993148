"""How often the covariance of a refined pose holds the truth, on simulated pictures with errors of known size.

    python -m benchmarks.uncertainty [--trials 500]

Trials of each kind: edges of boxes with noise, with arcs shifted as a whole, with a model that is off by its tolerance,
with a calibration that is off by its sigmas, by two cameras and by one.  The 95 % ellipsoids of the pose (six
dimensions) and of the rig's place alone (three) should hold the truth in 93 to 97 % of the trials.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.special import chdtri
from tabulate import tabulate

from tests.vision.localisation.simulation import Errors, simulate
from vision.cameras.cameras import CalibrationSigma

KINDS = {
    "noise": Errors(),
    "arcs shifted": Errors(arc_px=0.3),
    "tolerance": Errors(tolerance_mm=0.3),
    "calibration": Errors(calibration=CalibrationSigma(0.002, 0.5, 0.3, 0.002)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=500, help="trials of each kind and number of cameras")
    trials = parser.parse_args().trials
    rows = []
    for cameras in (("left", "right"), ("left",)):
        for name, errors in KINDS.items():
            outcomes = [simulate(errors, seed, cameras) for seed in range(trials)]
            pose = np.array([outcome.chi_square for outcome in outcomes])
            place = np.array([outcome.chi_square_centre for outcome in outcomes])
            held = [float((values <= chdtri(n, 0.05)).mean()) for values, n in ((pose, 6), (place, 3))]
            rows.append((name, len(cameras), trials, *held, float(pose.mean()), float(pose.max())))
    heads = ("errors", "cameras", "trials", "pose held", "place held", "mean chi2", "most")
    print(tabulate(rows, headers=heads, floatfmt=".3f"))


if __name__ == "__main__":
    main()
