"""How many answers of *Review* were right."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Add the column."""
    op.add_column("seat", sa.Column("recalled", sa.JSON, nullable=False, server_default=sa.text("'[]'")))
