"""The lease: one client at a time may move the arm. Pure; the time is an argument."""

import secrets
from dataclasses import dataclass

from pneuarm.controllers.arm.errors import LeaseRefused, MessageRejected, TargetRejected
from pneuarm.logs.schema.printable import printable

#: No key can hold these: a client's name is a part of its liveliness token's.
_NOT_IN_A_NAME = frozenset("/*$?#")
_LONGEST_NAME = 64


def check_name(client: str) -> None:
    """Raise MessageRejected for a client_id that cannot be told to people, or not be in a key."""
    if not 1 <= len(client) <= _LONGEST_NAME:
        raise MessageRejected(
            f"client_id has {len(client)} characters; it names who holds the arm, by 1 to "
            f"{_LONGEST_NAME} characters"
        )
    if not client.isprintable() or not _NOT_IN_A_NAME.isdisjoint(client):
        raise MessageRejected(
            f"client_id = '{printable(client)}': printable characters without "
            f"{' '.join(sorted(_NOT_IN_A_NAME))} are allowed"
        )


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

    def is_proved_by(self, payload: bytes) -> bool:
        """Whether a message holds the holder's secret: the cheapest check there is."""
        held = self._holder
        return held is not None and held.secret.encode() in payload

    def has_operator(self, now_s: float) -> bool:
        """Whether somebody holds the lease and was heard within its timeout."""
        held = self._holder
        return held is not None and now_s - held.heard_s <= self._timeout_s

    def take(self, client: str, secret: str, take_over: bool, now_s: float) -> tuple[str, bool]:
        """Grant the lease; return its secret, and whether it was taken from somebody else.

        The holder asks again with its secret and keeps it. A holder that has not been heard for
        the timeout has lost it. Raises LeaseRefused with the holder's name.
        """
        check_name(client)
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

    def check_target(self, client: str, secret: str, sequence: int) -> None:
        """Raise TargetRejected for a target that is not the holder's, or not its newest."""
        held = self._holder
        if held is None:
            raise TargetRejected("nobody holds the lease; enable the arm first")
        if held.client != client or held.secret != secret:
            raise TargetRejected(
                f"{printable(client, 64) or 'this client'} has no lease; {held.client} has it"
            )
        if sequence <= held.sequence:
            raise TargetRejected(
                f"sequence {sequence} is not above {held.sequence}, the last one; "
                "a repeated or overtaken message"
            )

    def take_target(self, client: str, secret: str, sequence: int, now_s: float) -> None:
        """Count a target that has passed all checks; raises TargetRejected as before."""
        self.check_target(client, secret, sequence)
        if self._holder is not None:
            self._holder.sequence, self._holder.heard_s = sequence, now_s

    def release(self, client: str, secret: str) -> None:
        """Give the lease back; raises LeaseRefused if it is not this client's."""
        held = self._holder
        if held is None or held.client != client or held.secret != secret:
            raise LeaseRefused(f"{printable(client, 64) or 'this client'} does not hold the lease")
        self._holder = None

    def client_gone(self, client: str) -> bool:
        """Forget a client whose liveliness ended; return whether it held the lease."""
        if self._holder is None or self._holder.client != client:
            return False
        self._holder = None
        return True
