"""Match the pictures of two cameras of a rig: arcs and regions in pairs, and the arcs in space.

Of the answer what each camera shows stands under the camera's name.
No model is needed: the pair itself gives the range of depths.  The method pong uses votes of epipolar rows, attributes
of arcs and regions, then relations; relational uses only relations, within the epipolar geometry.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import add_format, add_pictures, add_search, pictures_by_camera, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel stereo --rig rig.yaml left=L.png right=R.png --method pong --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--rig", type=Path, required=True, metavar="RIG.yaml", help="cameras and where the rig has them"
    )
    add_pictures(parser, "the two pictures, each with the name of its camera in the rig")
    parser.add_argument("--method", default="pong", metavar="METHOD", help="pong or relational (default: pong)")
    add_search(parser)
    parser.add_argument(
        "--no-keep-images", action="store_true", help="do not keep the bytes of the images in the store"
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.compiled import compile_ahead
    from relmodel.store import Store
    from vision.inspection.inspection_parameters import DEFAULTS, choose_methods
    from vision.inspection.stereo_pair import KERNELS, match_pair

    compile_ahead(KERNELS, say)
    with Store.open(store_target(args)) as store:
        answer = match_pair(
            store,
            rig=args.rig,
            pictures=pictures_by_camera(args.pictures),
            keep_images=not args.no_keep_images,
            parameters=choose_methods(DEFAULTS, stereo=args.method, search=args.search),
        )
    for words in answer.notes:
        say(words)
    result = answer.matches.solved.result
    say(f"run {answer.run}: {result.status}, cost {result.cost}, none below {result.bound}")
    rows = answer.rows()
    names = ("kind", *answer.cameras, "curve", "start", "end", "sigma_mm")
    print_rows(names, ([row[name] for name in names] for row in rows), args.format)
    return 0
