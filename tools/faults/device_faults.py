"""The device, its transport and the air behind it fail; the emulators do as they are told."""

from collections.abc import Callable

from pneuarm.hardware.transports.modbus import ModbusTerminal
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.rig import Rig
from tools.rig.daemon import enough

#: What breaks the transport zeroes the device: by a new connection, or by its own watchdog.
ZERO_S = 0.3

#: A monitor has seen enough of a broken sensor or valve after two turns of the circle, and the ramp
#: is over after so long.
_SEEN_S, _RAMPED_S = 4.0, 4.0

#: A leak is looked for in an arm that holds, from so long after its beginning.
_SETTLED_S = 1.2

#: A serial device that is there again is connected within so long.
_AGAIN_S = 2.0

#: What safety rests on in a terminal is read back within so long, and these are its registers.
_READ_BACK_S = 1.4
_WATCHDOG, _FAILSAFE = 46100, 46101

Words = Callable[[Injection], str]


def _transport(words: Words) -> Callable[[Rig, Injection], None]:
    """Something that makes the device unreachable or unbelievable: latched fault, zeros."""

    def inject(rig: Rig, injection: Injection) -> None:
        assert rig.emulator is not None
        injection.must_reach(pb.FAULT, within_s=0.6)
        injection.zero_within_s = ZERO_S
        injection.begin()
        rig.emulator.inject(words(injection))
        rig.wait_for_mode(pb.FAULT)
        rig.wait_until_empty()
        rig.emulator.inject("clear")

    return inject


def _foreign(register: int, value: int) -> Callable[[Rig, Injection], None]:
    """Another master writes a register that safety rests on: fault, and it is set again."""

    def inject(rig: Rig, injection: Injection) -> None:
        assert rig.emulator is not None
        port = int(rig.emulator.tables["festo_cpx"]["port"])
        other = ModbusTerminal("another master", "127.0.0.1", port, 1, 0.5)
        other.connect()
        injection.must_reach(pb.FAULT, within_s=_READ_BACK_S)
        injection.zero_within_s = _READ_BACK_S
        injection.begin()
        other.write(register, [value])
        rig.wait_for_mode(pb.FAULT)
        rig.wait_until_empty()
        if register == _WATCHDOG:
            rig.wait_until(lambda: other.read(register, 1) != [value], "the watchdog set again")
        other.write(_FAILSAFE, [0])
        other.close()

    return inject


def _broken_lines(words: Words) -> Callable[[Rig, Injection], None]:
    """Bytes are lost or wrong: lines that mean nothing are passed over, many are a fault."""

    def inject(rig: Rig, injection: Injection) -> None:
        assert rig.emulator is not None
        injection.begin()
        rig.emulator.inject(words(injection))
        rig.wait_until(enough(1.0), "broken lines")
        injection.must_stay(pb.ACTIVE, pb.HOLD, pb.FAULT)
        rig.emulator.inject("clear")

    return inject


def _cable_out(rig: Rig, injection: Injection) -> None:
    """Nobody can zero a device without a watchdog now: it is zeroed when it is there again."""
    assert rig.emulator is not None
    out_s = injection.random.uniform(0.3, 0.8)
    injection.must_reach(pb.FAULT, within_s=0.6)
    injection.zero_within_s = out_s + _AGAIN_S
    injection.begin()
    rig.emulator.inject(f"unplug {out_s:.3f}")
    rig.wait_for_mode(pb.FAULT)
    rig.wait_until(enough(out_s), "the cable")
    rig.wait_until_empty()


def _slow(rig: Rig, injection: Injection) -> None:
    """Answers late, but within the timeout."""
    assert rig.emulator is not None
    injection.begin()
    rig.emulator.inject(f"slow {injection.random.uniform(5.0, 15.0):.1f}")
    rig.wait_until(enough(1.0), "slow answers")
    injection.must_go_on()
    rig.emulator.inject("clear")


def _physical(words: Words, *modes: int, zeroed: bool = True) -> Callable[[Rig, Injection], None]:
    """Something breaks in the arm: a monitor sees it, and its policy acts."""

    def inject(rig: Rig, injection: Injection) -> None:
        assert rig.emulator is not None
        injection.must_reach(*modes, within_s=_SEEN_S)
        injection.begin()
        rig.emulator.inject(words(injection))
        rig.wait_for_mode(*modes)
        if zeroed:
            rig.wait_until(rig.emulator.is_zeroed, "zeros", _RAMPED_S)
        rig.emulator.inject("clear")

    return inject


def _leak(rig: Rig, injection: Injection) -> None:
    """In the fullest chamber of an arm that holds: where a valve regulates, a leak is refilled."""
    assert rig.emulator is not None
    rig.watcher.hold()
    rig.wait_until(enough(_SETTLED_S), "settled pressures")
    pressures_pa = [abs(p) for p in rig.watcher.state().pressure_sent_pa]
    injection.must_reach(pb.FAULT, within_s=_SEEN_S)
    injection.begin()
    rig.emulator.inject(f"leak {pressures_pa.index(max(pressures_pa))}")
    rig.wait_for_mode(pb.FAULT)
    rig.emulator.inject("clear")


def _unclear(words: Words) -> Callable[[Rig, Injection], None]:
    """Something that may be too small to be seen: it changes nothing, or it is a fault."""

    def inject(rig: Rig, injection: Injection) -> None:
        _look_on(rig, injection, words)

    return inject


def _look_on(rig: Rig, injection: Injection, words: Words) -> None:
    assert rig.emulator is not None
    injection.begin()
    rig.emulator.inject(words(injection))
    rig.wait_until(enough(1.0), "what comes of it")
    injection.must_stay(pb.ACTIVE, pb.HOLD, pb.FAULT)
    rig.emulator.inject("clear")


def _chamber(word: str, *values: str) -> Words:
    return lambda injection: " ".join((word, str(injection.random.randrange(3)), *values))


def _for(word: str, least_s: float, most_s: float) -> Words:
    return lambda injection: f"{word} {injection.random.uniform(least_s, most_s):.3f}"


def _offset(injection: Injection) -> str:
    offset_bar = injection.random.choice((-1, 1)) * injection.random.uniform(0.4, 0.8)
    return _chamber("sensor-offset", f"{offset_bar:.2f}")(injection)


_CPX = "festo-cpx"
_LATCHED = "fault at once, zeros, latched"
_RAMPED = "fault, ramps to zero, latched"


def _tcp(name: str, words: Words) -> Fault:
    return Fault(f"terminal: {name}", _LATCHED, _transport(words), device=_CPX)


def _air(name: str, words: Words, policy: str = _RAMPED, *modes: int) -> Fault:
    zeroed = pb.HOLD not in modes
    inject = _physical(words, *(modes or (pb.FAULT,)), zeroed=zeroed)
    return Fault(f"air: {name}", policy, inject, device=_CPX)


def _serial(device: str) -> tuple[Fault, ...]:
    lines = "goes on, holds, or fault and zeros, latched"
    garbage = _broken_lines(lambda injection: "garbage")
    half = _broken_lines(_for("half-lines", 0.2, 0.6))
    return (
        Fault(f"{device}: garbage", lines, garbage, device=device),
        Fault(f"{device}: half lines", lines, half, device=device),
        Fault(f"{device}: cable out", "fault; zeros once it is back", _cable_out, device=device),
    )


FAULTS = (
    _tcp("TCP reset", lambda injection: "reset"),
    _tcp("TCP silence", _for("silence", 0.4, 1.0)),
    _tcp("unreachable", _for("unplug", 0.4, 1.0)),
    _tcp("answers too late", lambda injection: "slow 120"),
    Fault("terminal: slow answers", "goes on", _slow, device=_CPX),
    _tcp("Modbus exceptions", lambda i: f"exception {i.random.randint(1, 3)}"),
    _tcp("answer to another question", lambda injection: "wrong"),
    _tcp("garbage for an answer", lambda injection: "garbage"),
    Fault("terminal: watchdog off, another master", _LATCHED, _foreign(_WATCHDOG, 0), device=_CPX),
    Fault("terminal: watchdog 60 s", _LATCHED, _foreign(_WATCHDOG, 60_000), device=_CPX),
    Fault(
        "terminal: fail-safe 'hold last state'",
        _LATCHED,
        _foreign(_FAILSAFE, 1),
        device=_CPX,
    ),
    _air("sensor not a number", _chamber("sensor-nan")),
    _air("sensor frozen", _chamber("sensor-frozen")),
    _air("sensor offset, 0.4 to 0.8 bar", _offset),
    Fault(
        "air: sensor noisy, 0.2 bar",
        "goes on, or fault",
        _unclear(_chamber("sensor-noisy")),
        device=_CPX,
    ),
    _air("valve stuck open", _chamber("valve-stuck-open")),
    _air("valve stuck closed", _chamber("valve-stuck-closed")),
    Fault("air: leak while it holds", _RAMPED, _leak, device=_CPX),
    Fault("air: leak while it moves", "goes on, or fault", _unclear(_chamber("leak")), device=_CPX),
    _air("supply lost", lambda i: "supply-lost", "holds or fault", pb.HOLD, pb.FAULT),
    *_serial("ctrl-p"),
    *_serial("esp32"),
)
