#!/bin/sh
# From a STEP file to a report that is signed, in the root of a checkout: sh examples/journey.sh FOLDER
set -e
python -m examples.journey "$1"  # in place of your own part.step, world.yaml, rig.yaml, prior.yaml and pictures
cd "$1"
export RELMODEL_STORE=cell.duckdb

# The model, and where it stands.
relmodel init
relmodel load part.step --object bracket
relmodel world world.yaml

# The tolerances: a row a size, which you edit.
relmodel sql --format csv "SELECT path, what, nominal, 0.5 AS plus, 0.5 AS minus FROM characteristic WHERE what = 'diameter'" > tolerances.csv
relmodel tolerances tolerances.csv

# The cameras, and what they see of one part.
relmodel rig check rig.yaml left=left.png right=right.png --prior prior.yaml
relmodel inspect --rig rig.yaml left=left.png right=right.png --prior prior.yaml --serial SN-0001 --operator "operator 3"

# A person decides about the finding; the page is printed and signed, and can be held against the store later.
relmodel accept 1 --by quality --note "concession 118: bushed"
relmodel report --serial SN-0001 -o part.html
relmodel check --report part.html
