"""Which rooms were opened from one address."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Add the column."""
    op.add_column("room", sa.Column("opener", sa.Integer, nullable=False, server_default=sa.text("0")))
