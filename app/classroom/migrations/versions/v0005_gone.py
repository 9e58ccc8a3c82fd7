"""Whether a student has stopped following."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Add the column."""
    op.add_column("seat", sa.Column("gone", sa.Boolean, nullable=False, server_default=sa.false()))
