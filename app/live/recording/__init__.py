"""Recordings of a connection: what a program sends and hears, over time, as a file."""

from app.live.recording.files import read, read_mcap, save, to_mcap
from app.live.recording.recording import Bounds, Entry, Recording, Track
from app.live.recording.table import to_csv

__all__ = ["Bounds", "Entry", "Recording", "Track", "read", "read_mcap", "save", "to_csv", "to_mcap"]
