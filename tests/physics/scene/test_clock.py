import numpy as np
import pytest

from physics.scene import clock
from physics.scene.material import DT
from tests.reference import load


@pytest.mark.parametrize(("duration", "steps"), [(0.0, 0), (0.01, 1), (30.0, 1801), (60.0, 3601)])
def test_steps_of_the_accumulated_clock(duration, steps):
    assert clock.steps_in(duration) == steps


@pytest.mark.parametrize("duration", [-1.0, float("inf"), float("nan")])
def test_duration_must_be_a_length_of_time(duration):
    with pytest.raises(ValueError, match="duration: expected a finite number"):
        clock.steps_in(duration)


def test_times_add_up_one_by_one():
    expected, time = [], 0.0
    for _ in range(4000):
        time += DT
        expected.append(time)
    assert clock.times(4000).tolist() == expected


def test_times_without_adding_up_are_those_of_adding_up():
    steps = 2**22  # 19 hours, past sixteen powers of two
    accumulated = clock.times(steps)
    near = [2**k / DT + d for k in range(17) for d in range(-3, 4)]  # where rounding changes
    chosen = np.unique(np.clip([*range(1, 5000), *range(1, steps, 997), *near], 1, steps))
    chosen = chosen.astype(np.int64)
    assert (clock.times_after(chosen) == accumulated[chosen - 1]).all()
    assert clock.times_after(np.array([0])) == 0


def test_steps_of_a_duration_are_those_of_counting():
    times = clock.times(5000)
    for step in (1, 2, 59, 60, 61, 127, 128, 129, 1801, 4999):
        time = times[step - 1]
        assert clock.steps_in(time) == step
        assert clock.steps_in(np.nextafter(time, 0)) == step
        assert clock.steps_in(np.nextafter(time, np.inf)) == step + 1


def test_the_longest_duration_has_an_answer_and_longer_ones_are_refused():
    longest = clock.time_after(clock.MOST_STEPS)
    assert clock.steps_in(longest) == 2**31
    assert longest == pytest.approx(2**31 * DT, rel=1e-6)
    with pytest.raises(ValueError, match="duration: expected at most 35791393 s"):
        clock.steps_in(1e9)


@pytest.mark.parametrize(("interval", "lengths"), [(0.25, {15, 16}), (0.5, {30, 31})])
def test_windows_hold_the_samples_not_older_than_the_interval(interval, lengths):
    n = 600
    t = clock.times(n).tolist()
    expected = [sum(t[j] >= t[k] - interval for j in range(k + 1)) for k in range(n)]
    windows = clock.window_lengths(n, interval)
    assert windows.tolist() == expected
    assert set(windows[40:].tolist()) == lengths


@pytest.mark.parametrize("interval", [0.25, 0.3, 0.5, 2.0])
def test_windows_beyond_the_first_steps_change_where_those_of_counting_do(interval):
    after, n = 500, 2**21
    steps, lengths = clock.window_changes(after, interval)
    own = steps <= n
    windows = clock.window_lengths(n, interval)
    changes = np.flatnonzero(windows[after + 1 :] != windows[after:-1]) + after + 2
    assert steps[own].tolist() == [after + 1, *changes]
    assert (lengths[own] == windows[steps[own] - 1]).all()
    assert steps[-1] > 5e8
    for step, length in zip(steps, lengths, strict=True):
        span = clock.times_after(step - np.arange(length + 2))
        assert (span >= span[0] - interval).sum() == length


def test_windows_are_those_of_the_recorded_touch_readings():
    record = load("sensors_biped")
    column = record["names_high"].tolist().index("v3_0_touch")
    readings = record["readings"][:, column]
    touched = record["touching"][:, 1].any(axis=1)  # voxel 1 is v3_0
    sums = np.cumsum(np.concatenate(([0], touched)))
    steps = np.arange(1, len(readings) + 1)
    windows = clock.window_lengths(len(readings), 0.25)
    assert readings == pytest.approx((sums[steps] - sums[steps - windows]) / windows, abs=1e-15)
    assert 0.1 < readings.mean() < 0.9


def test_interval_must_not_be_negative():
    with pytest.raises(ValueError, match="interval: expected seconds >= 0"):
        clock.window_lengths(10, -0.1)
