"""Features of parts that the CAD kernel composes from known operations, and of the bulkhead: recall, precision, speed.

    python benchmarks/features.py [PARTS]

A generator that the recogniser grew up with, others of other hands that it was held out from (their figures before
anything was mended, in it or in what they state, stand in the titles), and the six variants of the demonstration
bulkhead against the golden tables of their generator.  A feature counts as found where kind, place (0.05 mm) and every
dimension (0.05 mm or rad) are right; of the bulkhead's, where those that its table names are.
"""

import sys
from pathlib import Path
from time import process_time

from tabulate import tabulate

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the tests' generators

from relmodel.features import recognise
from relmodel.readers.step import shape as step_shape
from tests.features.feature_scores import Scores, score
from tests.features.golden_features import VARIANTS, score_bulkhead
from tests.parts.brackets_and_drums import foundry
from tests.parts.composed_parts import generate
from tests.parts.flanges_and_housings import toolroom
from tests.parts.machining_features import vocabulary
from tests.parts.open_cuts_and_rows import plate_with_open_cuts
from tests.parts.plates_with_bosses import welded
from tests.parts.random_cuts import crowd
from tests.parts.turned_parts import workshop

PARTS = 216
SECOND_BEFORE = "recall 0.749, precision 0.747 over 240 parts"
THIRD_BEFORE = "recall 0.734, precision 0.646 over 80 parts"
FOURTH_BEFORE = "recall 0.928, precision 0.957 over 96 parts"
FIFTH_BEFORE = "recall 0.702, precision 0.926 over 96 parts"
OPEN_CUTS_BEFORE = "recall 0.706, precision 0.816 over 96 parts"
CROWD_BEFORE = "recall 0.957 over 96 parts"


def main() -> None:
    parts = int(sys.argv[1]) if len(sys.argv) > 1 else PARTS
    show(f"{parts} parts of the first generator", score(generate, range(parts)))
    show(f"{parts} parts of the second generator (before it was seen: {SECOND_BEFORE})", score(workshop, range(parts)))
    show(f"{parts} parts of the third generator (before it was seen: {THIRD_BEFORE})", score(toolroom, range(parts)))
    show(f"{parts} parts of the fourth generator (before it was seen: {FOURTH_BEFORE})", score(foundry, range(parts)))
    show(f"{parts} parts of the fifth generator (before it was seen: {FIFTH_BEFORE})", score(vocabulary, range(parts)))
    show(f"{parts} plates with bosses", score(welded, range(parts)))
    show(
        f"{parts} plates with open cuts (before they were seen: {OPEN_CUTS_BEFORE})",
        score(plate_with_open_cuts, range(parts)),
    )
    show(
        f"{parts} crowded parts, precision without bearing (before they were seen: {CROWD_BEFORE})",
        score(crowd, range(parts)),
    )
    bulkheads = Scores()
    for variant in VARIANTS:
        bulkheads += score_bulkhead(variant)
    show(f"{len(VARIANTS)} variants of the bulkhead", bulkheads)
    shapes = [step_shape.extract(make(seed).body, {}, {}, {}) for make in (generate, workshop) for seed in range(12)]
    start = process_time()
    for shape in shapes:
        recognise(shape)
    faces = sum(len(shape.surfaces["kind"]) for shape in shapes)
    print(f"{faces / (process_time() - start):.0f} faces/s of CPU on {len(shapes)} parts of {faces} faces")


def show(title: str, scores: Scores) -> None:
    rows = [
        (kind, scores.known[kind], scores.found[kind], scores.recall(kind), scores.precision(kind))
        for kind in sorted(scores.known | scores.found)
    ]
    rows.append(
        ("all", scores.known.total(), scores.found.total(), scores.total_recall, scores.total_precision),
    )
    print(title)
    print(tabulate(rows, headers=("kind", "known", "found", "recall", "precision"), floatfmt=".3f"))
    for seed, known in scores.missed:
        print(f"missed in {seed}: {known.kind} {known.dimensions}")
    for seed, feature in scores.false:
        print(f"false in {seed}: {feature.kind} {feature.dimensions}")
    print()


if __name__ == "__main__":
    main()
