"""What `smoke_ground latency` makes of a log, and the arguments it refuses; test/nodelets/rate.test
runs the probe itself."""

import numpy as np
import pytest

from smoke_ground_reconstruction import latency
from smoke_ground_reconstruction.cli import main
from smoke_ground_reconstruction.commands.latency import report
from smoke_ground_reconstruction.console import CommandError

MS = 1_000_000  # [ns]


def a_scan(seq, sent, arrived, pipeline_ms=0.0, floors=1):
    return {
        "seq": seq,
        "sent": sent * MS,
        "arrived": arrived * MS,
        "floors": floors,
        "pipeline_ms": pipeline_ms,
    }


def at_work(stage, seq, begun, *handed_over, **parts):
    handed_over = [time * MS for time in handed_over]
    timing = {"seq": seq, "begun": begun * MS, "handed_over": handed_over}
    timing.update(parts=list(parts), milliseconds=list(parts.values()))
    return {"stage": stage, "scans": [timing]}


def log_of(scans, stages):
    looks = [(0, 100.0, 1.0), (1000, 110.0, 1.5), (2000, 111.0, 2.0)]
    process = [{"time": t * MS, "resident_mb": mb, "cpu_s": s} for t, mb, s in looks]
    return {"scans": scans, "stages": stages, "process": process}


THREE_STAGES = [
    # Nobody listens to the noise.
    at_work("denoiser", 7, 102, 110, 0, organise=2.0, denoise=5.0, publish=1.0),
    at_work("reconstructor", 7, 127, 130, organise=0.5, reconstruct=2.0, publish=0.5),
    # The walls are the last that the next one needs.
    at_work("segmenter", 7, 111, 120, 123, organise=2.0, segment=4.0, cluster=3.0, publish=3.0),
]


def test_the_way_of_a_scan_from_hand_to_hand():
    hops = latency.hops(log_of([a_scan(7, 100, 134, pipeline_ms=22.0)], THREE_STAGES))
    assert {name: times.tolist() for name, times in hops.parts.items()} == {
        "driver -> denoiser": [2.0],
        "denoiser": [8.0],
        "denoiser -> segmenter": [1.0],
        "segmenter": [12.0],
        "segmenter -> reconstructor": [4.0],
        "reconstructor": [3.0],
        "reconstructor -> listener": [4.0],
    }
    assert hops.whole.tolist() == [30.0]  # up to the publishing of the floor
    assert hops.pipeline.tolist() == [22.0]
    # 7 ms from hand to hand, 2.5 ms of laying out again, 4.5 ms of writing clouds: all but 16 ms.
    assert hops.added.tolist() == [14.0]


def test_a_stage_that_sleeps_is_no_hop():
    stages = [at_work("reconstructor", 1, 3, 9)]
    hops = latency.hops(log_of([a_scan(1, 1, 10), a_scan(2, 11, 0, floors=0)], stages))
    assert list(hops.parts) == ["driver -> reconstructor", "reconstructor", latency.LISTENER]
    assert hops.whole.tolist() == [8.0]
    assert len(hops.pipeline) == 0


def test_no_floor_is_an_error():
    with pytest.raises(CommandError, match="no scan was seen on its whole way"):
        latency.hops(log_of([a_scan(1, 1, 0, floors=0)], THREE_STAGES))


def test_what_was_lost_and_taken_at_a_rate():
    scans = [a_scan(1, 0, 99), a_scan(2, 100, 104), a_scan(3, 200, 0, floors=0)]
    scans.append(a_scan(4, 300, 306, floors=2))
    load = latency.load(log_of(scans, []), 3)  # the first was played before
    assert (load.played, load.dropped, load.twice) == (3, 1, 1)
    assert load.latency.tolist() == [4.0, 6.0]
    assert load.cores == pytest.approx(0.5)
    np.testing.assert_array_equal(load.resident_mb, [100.0, 110.0, 111.0])


def test_the_report_shows_both():
    log = log_of([a_scan(7, 100, 134, pipeline_ms=22.0)], THREE_STAGES)
    lines = list(report(latency.hops(log), latency.load(log, 1), 10.0))
    assert "| denoiser -> segmenter | 1.00 | 1.00 |" in lines
    assert "| graph minus Pipeline | 8.00 | 8.00 |" in lines
    assert lines[-1].startswith("1 scans at 10 Hz: 0 dropped, 0 came twice, latency p50 34.00 ms")


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        (["--rate", "0"], "--rate and --seconds must be above 0"),
        (["--rate", "inf"], "--rate and --seconds must be above 0 and finite"),
        (["--compare", "-1"], "--compare must not be negative"),
        (["--queue-size", "0"], "--queue-size must be at least 1"),
    ],
)
def test_bad_arguments_are_one_line(arguments, complaint, capsys):
    assert main(["latency", "room.bag", *arguments]) == 1
    assert complaint in capsys.readouterr().err
