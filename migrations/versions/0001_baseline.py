"""The schema of the first release: the SQL in the folder 0001, a frozen copy of schema/.

Until that release `make baseline` copies schema/ anew; from then on the folder stays as it is, and a change of
schema/ comes with a revision of its own (see migrations/README.md).
"""

from pathlib import Path

from alembic import op

from relmodel.store.sql import schema_scripts

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    for script in schema_scripts(connection.dialect.name, Path(__file__).parent / "0001"):
        connection.exec_driver_sql(script)
