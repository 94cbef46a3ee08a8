"""The STM32 app's core, a GAP8's, and what lies between them."""

import numpy as np

from airtouch.detector.shared.channels import level_acceleration
from airtouch.kernels.app_core import DETECTORS, HEALTH, AppCore, Gap8Core
from airtouch.logs.flight_log import GYRO, PWM


def signals(log):
    """A flight log, and of it all that the cores are given here: level acceleration, rates and PWM."""
    return log, level_acceleration(log), log.stack(GYRO), log.stack(PWM)


class Drone:
    """Both cores and what lies between them."""

    def __init__(self, detector, loss=0.0, seed=0, have_gap8=True, answers=True, beats=False):
        self.app = AppCore({"detector": DETECTORS.index(detector)}, have_gap8=have_gap8)
        self.gap8 = Gap8Core()
        self.rng = np.random.default_rng(seed)
        self.loss, self.answers, self.beats = loss, answers, beats
        self.sent, self.steps = 0, 0

    def step(self, acc, gyro, pwm):
        edge = self.app.step(acc, gyro, pwm)
        self.steps += 1
        if self.steps % 50 == 0:
            beat = self.gap8.heartbeat(10 * self.steps)
            if self.beats and beat:
                self.app.receive(beat)
        for packet in self.app.packets():
            self.sent += 1
            if not self.answers or self.rng.random() < self.loss:
                continue
            reply = self.gap8.take(packet)
            if reply and self.rng.random() >= self.loss:
                self.app.receive(reply)
        return edge

    def fly(self, flight, stop=None):
        """Edges (sample, kind) of a flight."""
        _, acc, gyro, pwm = flight
        kinds = [(i, self.step(acc[i], gyro[i], pwm[i])) for i in range(len(acc))[:stop]]
        return [(i, kind) for i, kind in kinds if kind != "none"]

    @property
    def health(self):
        return {name for name, bit in HEALTH.items() if self.app.log.health & bit}


def edges_and_rows(drone, flight, changes):
    """Edges, logits, thresholds and alerts of a flight with changes of parameters, step by step."""
    _, acc, gyro, pwm = flight
    rows, edges = [], []
    for i in range(len(acc)):
        if i in changes:
            assert drone.app.set_params(**changes[i]) == 0
        kind = drone.step(acc[i], gyro[i], pwm[i])
        edges += [(i, kind)] if kind != "none" else []
        log = drone.app.log
        rows.append([*log.logit, log.probability, log.answers, log.threshold, log.alert])
    return edges, np.array(rows)
