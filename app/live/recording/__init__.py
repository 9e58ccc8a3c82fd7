"""Recordings of a connection: what a program sends and hears, over time, as a file."""

from app.live.recording.files import read_mcap, save, to_csv, to_mcap
from app.live.recording.recording import Entry, Recording, Track

__all__ = ["Entry", "Recording", "Track", "read_mcap", "save", "to_csv", "to_mcap"]
