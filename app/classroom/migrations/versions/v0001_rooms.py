"""Rooms, seats, attempts."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make the tables of a new database."""
    op.create_table(
        "setting",
        sa.Column("name", sa.String(64), primary_key=True),
        sa.Column("value", sa.Text, nullable=False),
    )
    op.create_table(
        "room",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("code", sa.String(16), nullable=False, unique=True),
        sa.Column("title", sa.String(200), nullable=False),
        sa.Column("created", sa.Double, nullable=False),
        sa.Column("ends", sa.Double, nullable=False, index=True),
        sa.Column("version", sa.BigInteger, nullable=False),
        sa.Column("state", sa.JSON, nullable=False),
        sa.Column("page", sa.Text, nullable=False),
        sa.Column("beat", sa.BigInteger, nullable=False),
    )
    op.create_table(
        "seat",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column(
            "room_id", sa.String(32), sa.ForeignKey("room.id", ondelete="CASCADE"), nullable=False, index=True
        ),
        sa.Column("alias", sa.String(64), nullable=False),
        sa.Column("joined", sa.Double, nullable=False),
        sa.Column("hand", sa.Double, nullable=False),
        sa.Column("task", sa.String(200), nullable=False),
        sa.Column("tries", sa.Integer, nullable=False),
        sa.Column("solved", sa.Boolean, nullable=False),
        sa.Column("voted", sa.String(32), nullable=False),
        sa.Column("vote", sa.Integer, nullable=False),
        sa.Column("page", sa.Text, nullable=False),
        sa.Column("beat", sa.BigInteger, nullable=False),
        sa.Column("version", sa.BigInteger, nullable=False),
        sa.Column("removed", sa.Boolean, nullable=False, server_default=sa.false()),
    )
    op.create_table(
        "attempt",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column(
            "room_id", sa.String(32), sa.ForeignKey("room.id", ondelete="CASCADE"), nullable=False, index=True
        ),
        sa.Column(
            "seat_id", sa.String(32), sa.ForeignKey("seat.id", ondelete="CASCADE"), nullable=False, index=True
        ),
        sa.Column("exercise", sa.String(200), nullable=False),
        sa.Column("seed", sa.BigInteger, nullable=False),
        sa.Column("answer", sa.JSON, nullable=False),
        sa.Column("verdict", sa.Text, nullable=False),
        sa.Column("score", sa.Double, nullable=False),
        sa.Column("started", sa.Double, nullable=False),
        sa.Column("at", sa.Double, nullable=False),
    )
