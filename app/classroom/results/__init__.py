"""Results of students: attempts as a table and as CSV, and signed result codes."""

from app.classroom.results.codes import (
    CodeError,
    ForgedCodeError,
    MistypedCodeError,
    Outcome,
    read_code,
    write_code,
)

__all__ = ["CodeError", "ForgedCodeError", "MistypedCodeError", "Outcome", "read_code", "write_code"]
