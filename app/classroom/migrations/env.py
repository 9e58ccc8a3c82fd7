"""What Alembic runs: the migrations, on the connection that `app.classroom.database` has opened and locked."""

from alembic import context

from app.classroom.tables import Base

context.configure(connection=context.config.attributes["connection"], target_metadata=Base.metadata)
context.run_migrations()
