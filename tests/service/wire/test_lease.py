"""The lease: one client at a time, proved by a secret; the time is an argument."""

import pytest

from pneuarm.controllers.arm.errors import LeaseRefused, MessageRejected, TargetRejected
from pneuarm.service.wire.lease import Lease

TIMEOUT_S = 5.0


def held(by: str = "ann", now_s: float = 0.0) -> tuple[Lease, str]:
    lease = Lease(TIMEOUT_S)
    secret, taken = lease.take(by, "", False, now_s)
    assert not taken
    return lease, secret


def take(lease: Lease, client: str, secret: str, sequence: int, now_s: float) -> None:
    """Check a target, and count it when it has passed all the other checks too."""
    lease.check_target(client, secret, sequence)
    lease.take_target(client, secret, sequence, now_s)


def test_the_first_who_asks_gets_it_with_a_secret_nobody_guesses() -> None:
    lease = Lease(TIMEOUT_S)
    assert lease.holder == ""
    secret, taken = lease.take("ann", "", False, 0.0)
    assert (lease.holder, taken) == ("ann", False)
    assert len(secret) >= 16
    assert held()[1] != held()[1]


@pytest.mark.parametrize("secret", ["", "wrong"])
@pytest.mark.parametrize("client", ["bob", "ann"])
def test_others_are_refused_with_the_holders_name(client: str, secret: str) -> None:
    lease, _ = held()
    with pytest.raises(LeaseRefused, match=r"^ann holds the arm; .*--take-over"):
        lease.take(client, secret, False, TIMEOUT_S)
    assert lease.holder == "ann"


def test_the_holder_keeps_its_secret_when_it_asks_again() -> None:
    lease, secret = held()
    assert lease.take("ann", secret, False, 1.0) == (secret, False)
    assert lease.take("ann", secret, True, 1.0) == (secret, False)


def test_somebody_else_may_take_over_and_the_old_secret_is_worthless() -> None:
    lease, old = held()
    secret, taken = lease.take("bob", "", True, 0.1)
    assert (lease.holder, taken) == ("bob", True)
    assert secret != old
    with pytest.raises(TargetRejected, match="ann has no lease; bob has it"):
        take(lease, "ann", old, 1, 0.2)
    with pytest.raises(LeaseRefused):
        lease.release("ann", old)


def test_a_holder_that_is_silent_for_the_timeout_has_lost_it() -> None:
    lease, _ = held(now_s=100.0)
    with pytest.raises(LeaseRefused):
        lease.take("bob", "", False, 100.0 + TIMEOUT_S)
    _, taken = lease.take("bob", "", False, 100.0 + TIMEOUT_S + 1e-6)
    assert (lease.holder, taken) == ("bob", True)


def test_targets_and_asking_again_keep_it_alive() -> None:
    lease, secret = held()
    take(lease, "ann", secret, 1, 4.0)
    with pytest.raises(LeaseRefused):
        lease.take("bob", "", False, 8.0)
    lease.take("ann", secret, False, 8.0)
    with pytest.raises(LeaseRefused):
        lease.take("bob", "", False, 12.0)
    lease.take("bob", "", False, 13.1)


def test_a_refused_target_keeps_nothing_alive() -> None:
    lease, secret = held()
    take(lease, "ann", secret, 5, 0.0)
    with pytest.raises(TargetRejected):
        take(lease, "ann", secret, 5, 4.0)
    lease.take("bob", "", False, 5.1)


@pytest.mark.parametrize("sequence", [7, 6, 0])
def test_a_replayed_or_overtaken_target_is_refused(sequence: int) -> None:
    lease, secret = held()
    take(lease, "ann", secret, 7, 0.0)
    with pytest.raises(TargetRejected, match=f"sequence {sequence} is not above 7, the last one"):
        take(lease, "ann", secret, sequence, 0.1)
    take(lease, "ann", secret, 8, 0.2)
    take(lease, "ann", secret, 2**63, 0.2)  # gaps are allowed


def test_the_first_sequence_number_is_above_zero() -> None:
    lease, secret = held()
    with pytest.raises(TargetRejected, match="sequence 0 is not above 0"):
        take(lease, "ann", secret, 0, 0.0)


def test_a_new_lease_counts_from_the_beginning() -> None:
    lease, secret = held()
    take(lease, "ann", secret, 100, 0.0)
    lease.release("ann", secret)
    secret, _ = lease.take("ann", "", False, 1.0)
    take(lease, "ann", secret, 1, 1.0)


@pytest.mark.parametrize(("client", "secret"), [("ann", "wrong"), ("bob", None), ("", "")])
def test_a_target_without_the_lease_is_refused(client: str, secret: str | None) -> None:
    lease, real = held()
    with pytest.raises(TargetRejected, match=r"(this client|ann|bob) has no lease; ann has it"):
        take(lease, client, real if secret is None else secret, 1, 0.0)


def test_a_target_where_nobody_holds_it_is_refused() -> None:
    with pytest.raises(TargetRejected, match="nobody holds the lease; enable the arm first"):
        take(Lease(TIMEOUT_S), "ann", "", 1, 0.0)


def test_giving_it_back_needs_the_secret() -> None:
    lease, secret = held()
    with pytest.raises(LeaseRefused, match="ann does not hold the lease"):
        lease.release("ann", "wrong")
    assert lease.holder == "ann"
    lease.release("ann", secret)
    assert lease.holder == ""
    with pytest.raises(LeaseRefused):
        lease.release("ann", secret)


def test_a_client_that_is_gone_loses_it_and_others_do_not() -> None:
    lease, secret = held()
    assert not lease.client_gone("bob")
    assert lease.holder == "ann"
    assert lease.client_gone("ann")
    assert lease.holder == ""
    assert not lease.client_gone("ann")
    with pytest.raises(TargetRejected):
        take(lease, "ann", secret, 1, 0.0)


def test_there_is_an_operator_as_long_as_the_holder_is_heard() -> None:
    lease, secret = held(now_s=10.0)
    assert lease.has_operator(10.0 + TIMEOUT_S)
    assert not lease.has_operator(10.1 + TIMEOUT_S)
    take(lease, "ann", secret, 1, 20.0)
    assert lease.has_operator(20.0 + TIMEOUT_S)
    lease.release("ann", secret)
    assert not lease.has_operator(20.0)


def test_the_secret_is_in_no_event() -> None:
    lease, secret = held()
    shown = lease.redacted(f"ann {secret} 1 {secret}".encode())
    assert shown == b"ann **************** 1 ****************"
    assert lease.redacted(b"other") == b"other"
    assert Lease(TIMEOUT_S).redacted(b"other") == b"other"


def test_a_target_that_is_only_checked_counts_for_nothing() -> None:
    lease, secret = held()
    lease.check_target("ann", secret, 7)
    lease.check_target("ann", secret, 7)
    lease.take("bob", "", False, TIMEOUT_S + 0.1)  # nor does it keep the lease


def test_a_target_whose_lease_changed_hands_after_its_check_is_refused() -> None:
    lease, secret = held()
    lease.check_target("ann", secret, 1)
    lease.take("bob", "", True, 0.0)
    with pytest.raises(TargetRejected, match="bob has it"):
        lease.take_target("ann", secret, 1, 0.0)


@pytest.mark.parametrize(
    "client",
    ["", "x" * 65, "\x1b[2J", "a\nb", "a\rb", "\x00", "\x7f", "a/b", "a*", "$", "?", "#",
     "\u202e", "\u2028", "\u200b", "\ufeff", "\ud800", "a\tb", "\x9b31m"],
)  # fmt: skip
def test_a_holder_has_a_name_that_can_be_told(client: str) -> None:
    with pytest.raises(MessageRejected) as caught:
        Lease(TIMEOUT_S).take(client, "", False, 0.0)
    assert "client_id" in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("client", ["a", "ann", "x" * 64, "Jürgen's arm", "a@b-1f", "日本"])
def test_any_printable_name_may_hold_it(client: str) -> None:
    lease = Lease(TIMEOUT_S)
    lease.take(client, "", False, 0.0)
    assert lease.holder == client


def test_only_the_secret_proves_the_holder() -> None:
    lease, secret = held()
    assert lease.is_proved_by(b"\x0a\x03ann\x12\x10" + secret.encode() + b"rest")
    for other in (b"", b"ann", secret.encode()[:-1], b"\x00" * 60_000):
        assert not lease.is_proved_by(other)
    assert not Lease(TIMEOUT_S).is_proved_by(b"")
