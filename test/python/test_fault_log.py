"""Faults are told of once, and again when they come back."""

from smoke_ground_reconstruction.nodes.fault_log import AWAY, FaultLog


def test_tells_once_of_a_fault_that_each_scan_has():
    log = FaultLog()
    told = [log.is_news("no field 'x'", 0.1 * scan) for scan in range(10000)]
    assert told == [True] + 9999 * [False]


def test_tells_again_of_a_fault_that_was_away():
    log = FaultLog()
    assert log.is_news("no transform", 0.0)
    assert not log.is_news("no transform", AWAY)
    assert log.is_news("no transform", 2 * AWAY + 0.001)


def test_takes_faults_for_one_that_differ_in_numbers_alone():
    log = FaultLog()
    assert log.is_news("0.70 m given, measured 0.81 m", 0.0)
    assert not log.is_news("0.70 m given, measured 1.04 m", 0.0)
    assert log.is_news("0.70 ft given, measured 0.81 ft", 0.0)


def test_forgets_rather_than_grows():
    log = FaultLog()
    assert all(log.is_news("x" * length, 0.0) for length in range(1, 1000))
    assert len(log._seen) <= 32
