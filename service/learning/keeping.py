"""What was learnt is written whenever a trial was the best one: no end loses anything of it."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pneuarm.controllers.learning.learning import Learning, Trial
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.learning.file import save
from pneuarm.service.learning.telling import Telling, error_text, say


@dataclass
class Keeper:
    """Tells of every trial, and keeps the best; ``kept`` is the one whose offsets are written."""

    learning: Learning
    configuration: Configuration
    trajectory: str
    output: Path
    telling: Telling
    kept: Trial | None = None

    def take(self, trial: Trial) -> None:
        """Keep what a trial was sent with if it was the best, and tell of it: it is kept then."""
        try:
            if self.learning.has_learnt and trial is self.learning.best:
                save(self.output, self.trajectory, self.learning, self.configuration)
                self.kept = trial
        finally:
            self.telling.trial(trial)

    @contextlib.contextmanager
    def saying_what_is_kept(self) -> Iterator[None]:
        """Say what is kept of a learning that ends early."""
        try:
            yield
        except BaseException:
            self.telling.breaks_off()
            if self.kept is not None:
                say(f"the best trial is kept in {self.output}: {error_text(self.kept)}")
            elif self.learning.trials:
                say("nothing is kept: no trial was better than the first")
            raise
