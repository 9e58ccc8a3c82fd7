"""What a student's program drives with its arm."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the column."""
    op.add_column("seat", sa.Column("driven", sa.Text, nullable=False, server_default=""))
