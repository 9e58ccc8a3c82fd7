"""Which mistake led to a wrong answer."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Add the column."""
    op.add_column("attempt", sa.Column("cause", sa.String(60), nullable=False, server_default=""))
