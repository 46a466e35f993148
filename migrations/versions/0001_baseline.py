"""The schema of the first release.  Until that release this is `schema/` itself (see migrations/README.md)."""

from alembic import op

from relmodel.store.migrate import create_schema

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    create_schema(op.get_bind())
