"""The lease: one client at a time may move the arm. Pure; the time is an argument."""

import secrets
from dataclasses import dataclass

from pneuarm.controllers.arm.errors import LeaseRefused, MessageRejected, TargetRejected


@dataclass
class _Holder:
    client: str
    secret: str
    heard_s: float
    sequence: int = 0


class Lease:
    """Who holds the arm. The secret proves it; the sequence number keeps old targets out."""

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._holder: _Holder | None = None

    @property
    def holder(self) -> str:
        """Client that holds the lease, or an empty string."""
        return "" if self._holder is None else self._holder.client

    def redacted(self, payload: bytes) -> bytes:
        """Return a payload without the secret, for an event that everybody may read."""
        held = self._holder
        if held is None:
            return payload
        return payload.replace(held.secret.encode(), b"*" * len(held.secret))

    def has_operator(self, now_s: float) -> bool:
        """Whether somebody holds the lease and was heard within its timeout."""
        held = self._holder
        return held is not None and now_s - held.heard_s <= self._timeout_s

    def take(self, client: str, secret: str, take_over: bool, now_s: float) -> tuple[str, bool]:
        """Grant the lease; return its secret, and whether it was taken from somebody else.

        The holder asks again with its secret and keeps it. A holder that has not been heard for
        the timeout has lost it. Raises LeaseRefused with the holder's name.
        """
        if not client or len(client) > 64:
            raise MessageRejected(
                "client_id must have 1 to 64 characters, to name who holds the arm"
            )
        held = self._holder
        if held is not None and held.client == client and held.secret == secret:
            held.heard_s = now_s
            return secret, False
        if held is not None and not take_over and now_s - held.heard_s <= self._timeout_s:
            raise LeaseRefused(
                f"{held.client} holds the arm; wait for it to end, or take over (--take-over)"
            )
        self._holder = _Holder(client, secrets.token_hex(8), now_s)
        return self._holder.secret, held is not None

    def check_target(self, client: str, secret: str, sequence: int, now_s: float) -> None:
        """Take a target's claim to the lease; raises TargetRejected."""
        held = self._holder
        if held is None:
            raise TargetRejected("nobody holds the lease; enable the arm first")
        if held.client != client or held.secret != secret:
            raise TargetRejected(f"{client or 'this client'} has no lease; {held.client} has it")
        if sequence <= held.sequence:
            raise TargetRejected(
                f"sequence {sequence} is not above {held.sequence}, the last one; "
                "a repeated or overtaken message"
            )
        held.sequence = sequence
        held.heard_s = now_s

    def release(self, client: str, secret: str) -> None:
        """Give the lease back; raises LeaseRefused if it is not this client's."""
        held = self._holder
        if held is None or held.client != client or held.secret != secret:
            raise LeaseRefused(f"{client or 'this client'} does not hold the lease")
        self._holder = None

    def client_gone(self, client: str) -> bool:
        """Forget a client whose liveliness ended; return whether it held the lease."""
        if self._holder is None or self._holder.client != client:
            return False
        self._holder = None
        return True
