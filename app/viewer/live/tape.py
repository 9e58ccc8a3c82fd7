"""The recording of a page: it is made, saved, and played in the page with its commanded and its measured arm."""

from __future__ import annotations

from app.live import Line
from app.live.recording import Bounds, Recording, Track, to_csv, to_mcap
from app.live.recording.recording import OPENED, SHOWN
from app.viewer.feature import Stage, save_file
from app.viewer.live.pursuit import Pursuit
from app.viewer.panel.status import Notice
from kin import InputError
from kin.transforms import Array

SECONDS, BYTES = 600.0, 16 << 20  # of one recording
OF_ALL = 256 << 20  # bytes of the recordings of all pages of a process
LONGEST = 3600.0  # s of one that is opened: a program may record for longer than a page
WRITERS = {"MCAP": ".mcap", "CSV": ".csv"}


class Tape:
    """See the module. The page's worker calls it.

    Attributes:
        recording: the last one; None: there is none.
        time: where it is played, seconds.
        playing: whether the time goes on.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self.recording: Recording | None = None
        self.time = 0.0
        self.playing = False
        self._line: Line | None = None  # that is or was recorded
        self._track: Track | None = None
        self._pursuit = Pursuit(stage.arm.now.robot)

    @property
    def running(self) -> bool:
        """Whether it is being made."""
        return self.recording is not None and self.recording.ended is None

    @property
    def playable(self) -> bool:
        """Whether it can be shown: it is of the arm on show, which moves in it."""
        found = self.recording
        return (
            found is not None
            and not self.running
            and found.robot == self._stage.arm.now.robot
            and self.seconds > 0
        )

    @property
    def seconds(self) -> float:
        """How long it is."""
        return 0.0 if self.recording is None else self.recording.seconds

    def begin(self, line: Line) -> None:
        """Record from now on, in place of the last recording."""
        self.discard()
        arm, program = self._stage.arm.now, line.program
        self.recording = Recording(
            arm.robot, "" if program is None else program.name, Bounds(SECONDS, BYTES, OF_ALL)
        )
        self.recording.add(SHOWN, {"q": arm.q.tolist()})
        if self._stage.arm.opening is not None:
            self.recording.add(OPENED, {"gripper": self._stage.arm.opening})
        self._line, line.recording = line, self.recording

    def open(self, recording: Recording) -> None:
        """Have this recording in place of the last one."""
        self.discard()
        self.recording = recording

    def end(self, why: str) -> None:
        """End the recording; it stays, and is at its end."""
        if self.recording is not None and self.running:
            self.recording.end(why)
            self.time = self.seconds

    def discard(self) -> None:
        """Forget the recording."""
        self.end("discarded")
        self.stop()
        if self._line is not None:
            self._line.recording = None
        self.recording, self._track, self.time, self._line = None, None, 0.0, None

    def save(self, kind: str) -> None:
        """Download it."""
        assert self.recording is not None
        stage, file = self._stage, f"{self.recording.robot.id}-recording{WRITERS[kind]}"
        try:
            data = to_mcap(self.recording) if kind == "MCAP" else to_csv(self.recording).encode()
        except InputError as error:
            stage.status.show(
                Notice("error", "The recording was not saved", f"This format is for {error.expected}.")
            )
            return
        save_file(stage, file, data, "Radians, metres and seconds.")

    # Playing

    def play(self) -> None:
        """Go on from the present time, or begin again at the end; a driven arm first goes there."""
        self._pursuit = Pursuit(self._stage.arm.now.robot)
        if self.time >= self.seconds:
            self.time = 0.0
        self.playing = True
        self._stage.arm.playing = True

    def stop(self) -> None:
        """Leave the arm where it is."""
        if self.playing:
            self.playing = False
            self._stage.arm.playing = False

    def advance(self, seconds: float) -> Array | None:
        """Go on for so many seconds while it is played; returns the measured arm of the recording."""
        self.time += seconds
        if self.time >= self.seconds:
            self.stop()
        return self.show(min(self.time, self.seconds))

    def lead(self, seconds: float, measured: Array) -> None:
        """Lead a driven arm, measured now ``(n,)``, along what was commanded: no faster than it follows."""
        q, _ = self._at(self.time)
        if q is None or self._pursuit.goes_on(q, measured, seconds):
            self.advance(seconds)
        elif self._pursuit.begun:
            self.show(self.time, "It waits for the arm.")
        else:
            self.show(self.time, "The arm goes there first, no faster than its program lets it.")

    def show(self, time: float, words: str = "") -> Array | None:
        """Show the arm as it was commanded at a time; returns where it was measured."""
        self.time = time
        q, measured = self._at(time)
        assert self._track is not None
        opening = self._track.opening_at(time)
        if opening is not None and self._stage.arm.opening is not None:
            self._stage.arm.open_gripper(opening)
        if q is not None:
            self._stage.arm.move_to(q, Notice("hand", f"The recording at {time:.2f} s", words), at_once=True)
        return measured

    @property
    def measured_gripper(self) -> float | None:
        """How far the gripper was measured to be open at the present time; None: it is not known."""
        return None if self._track is None else self._track.measured_opening_at(self.time)

    def _at(self, time: float) -> tuple[Array | None, Array | None]:
        """Where the arm was commanded to be, within its limits, and where it was measured."""
        assert self.recording is not None
        if self._track is None:
            self._track = self.recording.track()
        q, measured = self._track.at(time)
        return None if q is None else self._stage.arm.now.robot.clip(q), measured
