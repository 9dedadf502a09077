"""A program beside the daemon that takes words and says lines."""

import contextlib
import queue
import subprocess
import sys
import threading
import time

from tools.rig.daemon import ROOT


class Program:
    """A program of ours beside the daemon, that takes words and says lines."""

    def __init__(self, module: str, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            process_group=0,
        )
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.strip())

    def tell(self, words: str) -> None:
        """Write one line to it."""
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(words + "\n")

    def hear(self, begins: str, patience_s: float = 25.0) -> str:
        """Wait for a line that begins so; return the rest of it."""
        until = time.monotonic() + patience_s
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                line = self._lines.get(timeout=0.1)
                if line.startswith(begins):
                    return line.removeprefix(begins).strip()
            if self.process.poll() is not None and self._lines.empty():
                break
        raise TimeoutError(f"{self.process.args!r} did not say {begins!r}")

    def ask(self, words: str, begins: str) -> str:
        """Write a line and wait for its answer."""
        self.tell(words)
        return self.hear(begins)

    def kill(self) -> None:
        """End it at once, stopped or not."""
        self.process.kill()
        self.process.wait(10)
