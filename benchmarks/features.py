"""Features of parts that the CAD kernel composes from known operations: recall and precision by kind, and speed.

    python benchmarks/features.py [PARTS]

A feature counts as found where kind, place (0.05 mm) and every dimension (0.05 mm or rad) are right.
"""

import sys
from pathlib import Path
from time import perf_counter

from tabulate import tabulate

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the tests' generator

from relmodel.loading import step_shape
from relmodel.loading.features import recognise
from tests.loading.feature_scores import score
from tests.loading.parts_generator import generate

PARTS = 216


def main() -> None:
    parts = int(sys.argv[1]) if len(sys.argv) > 1 else PARTS
    scores = score(range(parts))
    rows = [
        (kind, scores.known[kind], scores.found[kind], scores.recall(kind), scores.precision(kind))
        for kind in sorted(scores.known | scores.found)
    ]
    print(tabulate(rows, headers=("kind", "known", "found", "recall", "precision"), floatfmt=".3f"))
    for seed, known in scores.missed:
        print(f"missed in part {seed}: {known.kind} {known.dimensions}")
    for seed, feature in scores.false:
        print(f"false in part {seed}: {feature.kind} {feature.dimensions}")
    shapes = [step_shape.extract(generate(seed).body, {}, {}, {}) for seed in range(min(parts, 24))]
    start = perf_counter()
    for shape in shapes:
        recognise(shape)
    faces = sum(len(shape.surfaces["kind"]) for shape in shapes)
    print(f"\n{parts} parts; {faces / (perf_counter() - start):.0f} faces/s on {len(shapes)} of them")


if __name__ == "__main__":
    main()
