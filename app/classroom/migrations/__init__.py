"""Migrations of the classroom's tables, run by Alembic when a database is first opened."""
