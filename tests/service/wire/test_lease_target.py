"""What only the holder of the lease can do, and what a name may be at the least."""

import pytest

from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.service.wire.lease import Lease, check_name


def test_a_target_that_is_not_the_holders_counts_for_nothing() -> None:
    lease = Lease(1.0)
    with pytest.raises(TargetRejected):
        lease.take_target("a", "", 1, 0.0)
    secret, _ = lease.take("a", "", False, 0.0)
    for client, shown, sequence in (("b", secret, 1), ("a", "guessed", 1), ("a", secret, 0)):
        with pytest.raises(TargetRejected):
            lease.take_target(client, shown, sequence, 0.9)
    assert not lease.has_operator(1.5)  # none of them was heard
    lease.take_target("a", secret, 1, 1.5)
    assert lease.has_operator(2.4)
    with pytest.raises(TargetRejected):
        lease.take_target("a", secret, 1, 2.0)


def test_a_name_of_one_character_is_one() -> None:
    check_name("a")
