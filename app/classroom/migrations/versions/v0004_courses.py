"""Links of learning platforms to whole courses; attempts are found in the order of time."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the column, and replace an index by a longer one."""
    op.add_column("lti_seat", sa.Column("course", sa.JSON, nullable=False, server_default=sa.text("'[]'")))
    op.create_index("ix_attempt_room_id_at", "attempt", ["room_id", "at", "id"])
    op.drop_index("ix_attempt_room_id", "attempt")
