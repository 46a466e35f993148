"""The demonstration."""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import option, verb
from relmodel.app.cli.output import say
from relmodel.printing import print_rows


@verb(
    "relmodel demo --folder demo",
    option("--folder", type=Path, default=Path("demo"), help="where the results go (default: demo)"),
    option("--pair", default="00", help="which of the demonstration's stereo pairs (default: 00)"),
)
def demo(args: argparse.Namespace) -> int:
    """Run the demonstration: load the bulkhead, place it, inspect a rendered stereo pair, compare the pose with the
    truth.

    Everything lands in the folder given with --folder: the store, the model drawn over the images, the report."""
    import os

    from relmodel.app.report.write import write_report
    from relmodel.app.session import compile_behind
    from relmodel.compiled import compile_ahead
    from relmodel.errors import UsageError
    from relmodel.loading.load import load
    from relmodel.names import make_folder
    from relmodel.resources import resource_dir
    from relmodel.store import Store
    from relmodel.world.placement import place_world
    from vision.inspection import KERNELS, Task, inspect
    from vision.inspection.demonstration import PoseError, measure_pose_error, read_truth

    source = resource_dir("demo")
    truth_file = source / f"pair_{args.pair}_truth.json"
    if not truth_file.is_file():
        known = ", ".join(sorted(p.name[5:7] for p in source.glob("pair_*_truth.json")))
        raise UsageError(f"there is no pair {args.pair} in the demonstration: use one of {known}")
    truth = read_truth(truth_file)
    make_folder(args.folder)
    target = args.store or os.environ.get("RELMODEL_STORE") or str(args.folder / "cell.duckdb")
    overlay = args.folder / f"pair_{args.pair}_overlay.png"
    page = args.folder / f"pair_{args.pair}.html"

    with Store.create(target) as store:
        compile_behind(say)
        say(f"loading variant {truth.variant} of the demonstration bulkhead ...")
        report = load(store, source / f"bulkhead_{truth.variant}.step.gz", name="bulkhead", variant=truth.variant)
        say(f"  {report.status}: {report.parts} parts, {report.occurrences} placed, {report.faces_loaded} faces")
        world = place_world(store, source / ("world.yaml" if truth.variant == "A" else f"world_{truth.variant}.yaml"))
        compile_ahead(KERNELS, say)
        say(f"inspecting stereo pair {args.pair} ...")
        answer = inspect(
            store,
            Task(
                rig=source / f"pair_{args.pair}_rig.yaml",
                pictures={file.stem.split("_")[-1]: file for file in sorted(source.glob(f"pair_{args.pair}_*.png"))},
                prior=source / f"pair_{args.pair}_prior.yaml",
                world=world.world,
                overlay=overlay,
                match=True,
            ),
        )
        write_report(store, page, {"run": answer.run})
    parts = [(p["path"], p["level"], f"{p['visible_share']:.0%}") for p in answer.parts_in_view]
    print_rows(("in view", "level", "visible"), parts, "table")
    print(f"\nstore     {target}")
    print(f"overlay   {overlay}")
    print(f"report    {page}")
    print(f"time      {sum(answer.timings_s.values()):.1f} s for the inspection")
    if answer.world_from_rig is not None:
        off: PoseError = measure_pose_error(answer.world_from_rig, truth)
        print(f"pose      {off.target_mm:.3f} mm and {off.rotation_deg:.4f} degrees off the truth at the target point")
    print(f"because   {answer.reason}")
    print(f"verdict   {answer.outcome.words}")
    return 0 if answer.outcome.is_usable else 1
