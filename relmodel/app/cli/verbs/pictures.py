"""What pictures alone show: edges, arcs, regions, and pairs of them."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.app.cli.options import (
    FORMAT,
    NO_KEEP_IMAGES,
    SEARCH,
    open_store,
    option,
    pictures,
    pictures_by_camera,
    verb,
)
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store import Run
    from vision.cameras.images import Picture
    from vision.extraction.extract import Extraction
    from vision.extraction.extraction_parameters import ExtractionParameters

PACKAGES = ("numba", "numpy", "opencv-python-headless", "scipy")
_STAGES = ("edges", "linking", "filling", "arcs", "junctions", "regions", "topography", "relations")


@verb(
    "relmodel extract left.png right.png --stage arcs --picture arcs.png",
    option("images", nargs="+", type=Path, metavar="IMAGE", help="PNG, TIFF or JPEG, grey or colour"),
    option("--stage", choices=_STAGES, default="arcs", help="the stage that --picture shows (default: arcs)"),
    option("--picture", type=Path, metavar="PICTURE", help="draw what the stage found and write it here"),
    option("--mask", type=Path, metavar="IMAGE", help="look only where this picture is brighter than half"),
    option("--regions", choices=("leak-proof", "plain"), default="leak-proof", help="how regions are found"),
    NO_KEEP_IMAGES,
    FORMAT,
)
def extract(args: argparse.Namespace) -> int:
    """Extract edges, arcs, regions, topography and relations from pictures, and draw what a stage found.

    Stages: edges (sub-pixel elements), linking (chains), filling (chains with gaps bridged, weak ones cleared), arcs
    (red lines, blue circular, green elliptic, yellow free, grey likely texture), junctions (arcs, their ends closed
    where they meet), regions, topography (eleven labels), relations.
    Several pictures are drawn side by side.  With --store the rows are kept there."""
    from relmodel.app.cli.progress import shown
    from relmodel.compiled import compile_ahead
    from relmodel.drawing.draw import check_writable, save_side_by_side
    from vision.cameras.images import describe_reading, read_mask, read_picture
    from vision.extraction.extract import KERNELS, STAGES, extract
    from vision.extraction.extraction_parameters import ExtractionParameters, RegionParameters

    if args.picture:
        check_writable(args.picture)
    mask = read_mask(args.mask) if args.mask else None
    parameters = ExtractionParameters(regions=RegionParameters(kind=args.regions))
    with _run_of(args, parameters) as stored:
        pictures = [read_picture(path) for path in args.images]
        for words in describe_reading(pictures):
            say(words)
        compile_ahead(KERNELS, say)
        found = []
        with shown() as progress:
            for done, picture in enumerate(pictures):
                progress(f"{picture.file_name}: extracting", done, len(pictures))
                found.append(extract(picture.grey, parameters, mask=mask))
        if stored:
            _keep(stored, pictures, found, keep_bytes=not args.no_keep_images)
    if args.picture:
        draw_stage = STAGES[args.stage][0]
        drawn = [draw_stage(p.grey, extraction) for p, extraction in zip(pictures, found, strict=True)]
        save_side_by_side(args.picture, drawn)
        say(f"{args.stage} drawn in {args.picture}")
    rows = [
        (picture.file_name, stage, count(extraction))
        for picture, extraction in zip(pictures, found, strict=True)
        for stage, (_, count) in STAGES.items()
    ]
    print_rows(("image", "stage", "found"), rows, args.format)
    return 0


@contextmanager
def _run_of(args: argparse.Namespace, parameters: ExtractionParameters) -> Iterator[Run | None]:
    """The run that the rows go to; None where no store is named."""
    if not args.store:
        yield None
        return
    from dataclasses import asdict

    from relmodel.store import Run, Store, digest_inputs

    inputs = digest_inputs({f"image {i}": path for i, path in enumerate(args.images)})
    with (
        Store.open(args.store) as store,
        Run.begin(store, "extract", {"extraction": asdict(parameters)}, inputs=inputs, packages=PACKAGES) as run,
    ):
        yield run


def _keep(stored: Run, pictures: list[Picture], extractions: list[Extraction], *, keep_bytes: bool) -> None:
    """Write the rows of all extractions in a run."""
    from vision.cameras.record import record_picture
    from vision.extraction.rows import make_rows, record_extraction

    def write(connection: Connection) -> None:
        for picture, extraction in zip(pictures, extractions, strict=True):
            image = record_picture(stored, connection, picture, keep_bytes=keep_bytes)
            record_extraction(stored, connection, image, picture, extraction.parameters, make_rows(extraction))

    stored.transact(write)


@verb(
    "relmodel stereo --rig rig.yaml left=L.png right=R.png --method pong --store cell.duckdb",
    option("--rig", type=Path, required=True, metavar="RIG.yaml", help="cameras and where the rig has them"),
    pictures("the two pictures, each with the name of its camera in the rig"),
    option("--method", default="pong", metavar="METHOD", help="pong or relational (default: pong)"),
    SEARCH,
    NO_KEEP_IMAGES,
    FORMAT,
)
def stereo(args: argparse.Namespace) -> int:
    """Match the pictures of two cameras of a rig: arcs and regions in pairs, and the arcs in space.

    Of the answer what each camera shows stands under the camera's name.
    No model is needed: the pair itself gives the range of depths.  The method pong uses votes of epipolar rows,
    attributes of arcs and regions, then relations; relational uses only relations, within the epipolar geometry."""
    from relmodel.compiled import compile_ahead
    from vision.inspection.inspection_parameters import DEFAULTS, choose_methods
    from vision.inspection.stereo_pair import KERNELS, match_pair

    compile_ahead(KERNELS, say)
    with open_store(args) as store:
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
    print_rows(*answer.rows(), args.format)
    return 0
