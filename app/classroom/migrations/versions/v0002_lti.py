"""Rooms and seats of learning platforms (LTI), nonces that were used."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Add the tables."""
    op.create_table(
        "lti_room",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column(
            "room_id", sa.String(32), sa.ForeignKey("room.id", ondelete="CASCADE"), nullable=False, index=True
        ),
    )
    op.create_table(
        "lti_seat",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column(
            "seat_id", sa.String(32), sa.ForeignKey("seat.id", ondelete="CASCADE"), nullable=False, index=True
        ),
        sa.Column("issuer", sa.Text, nullable=False),
        sa.Column("client_id", sa.Text, nullable=False),
        sa.Column("subject", sa.String(255), nullable=False),
        sa.Column("address", sa.Text, nullable=False),
        sa.Column("exercise", sa.String(200), nullable=False),
    )
    op.create_table(
        "lti_nonce",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("expires", sa.Double, nullable=False, index=True),
    )
