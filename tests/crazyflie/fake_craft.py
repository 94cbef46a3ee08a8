"""A craft without a radio: the planner of the high-level commander, a point that follows it, log packets.

Time is its own: `sleep` makes it pass. It answers as crtp_commander_high_level.c and planner.c do.
"""

import queue
import random
import threading

from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.errors import AirTouchError

FLYING_PWM, PLATFORM_M = 38000, 0.7
PLAN_IDLE, PLAN_FLYING, PLAN_LANDING = "idle", "flying", "landing"


class FakeCraft:
    """See `airtouch.crazyflie.flight.Craft`."""

    def __init__(self, loss=0.0, silent=(), volts=4.0, busy=False, dead_link_at=None, restart_at=None,
                 platform=(1.0, 2.0), seed=1, uptime_s=0, falls=True, mute=False, unheard=()):
        self.samples, self.answers, self.lost = queue.SimpleQueue(), queue.SimpleQueue(), threading.Event()
        self.uptime_ms = 1000 * uptime_s  #: that its clock shows at the start
        self.loss, self.silent, self.volts, self.busy = loss, silent, volts, busy
        self.dead_link_at, self.restart_at, self.platform = dead_link_at, restart_at, platform
        self.falls = falls  #: at restart_at; otherwise only its clock starts again
        self.unheard = unheard  #: when commands reach it and its packets do not come: its log blocks are gone
        self.mute = mute  #: from restart_at on it sends no state
        self.heard: list = []  #: commands that reached it: (drone's clock, command)
        self.random = random.Random(seed)
        self.state, self.leg = PLAN_IDLE, None
        self.at = [0.0, 0.0, 0.0]
        self.crashed, self.restarted = False, False
        self.reopened = 0
        self.now, self._next = 0.0, 0

    @property
    def flying(self):
        return self.state != PLAN_IDLE

    def clock(self):
        return self.now

    def sleep(self, seconds):
        """Time passes: packets come, the link may break."""
        self.now += seconds
        if self.dead_link_at is not None and self.now > self.dead_link_at:
            self.lost.set()
        while self._next * 0.01 <= self.now:
            self._packet(self._next)
            self._next += 1

    def _out_of_reach(self):
        return any(a <= self.clock() < b for a, b in self.silent)

    def send(self, commands):
        for command in commands:
            if self.lost.is_set() or self._out_of_reach() or self.random.random() < self.loss:
                continue
            self.heard.append((self.now, command))
            code = self._plan(command)
            if self.random.random() >= self.loss:
                self.answers.put((command.kind, code))

    def ping(self):
        pass

    def reopen(self, patience_s):
        self.reopened += 1
        if self._out_of_reach() and self.reopened < 2:
            raise AirTouchError("nobody answers there")
        self.dead_link_at = None
        self.lost.clear()

    def revive(self):
        pass

    def _plan(self, c):
        now = self.clock()
        if self.busy:
            return 16
        if c.kind == "take-off":
            if self.state != PLAN_IDLE:
                return 1
            target = [self.at[0], self.at[1], c.z_m]
        elif c.kind == "land":
            if self.state == PLAN_LANDING:
                return 1
            target = [self.at[0], self.at[1], c.z_m]
        elif c.kind == "go":
            if self.state == PLAN_IDLE:
                self.crashed = True  # the real one would jump from the ground
            target = [c.x_m, c.y_m, c.z_m]
        else:
            self.crashed |= self.at[2] > 0.1
            self.state = PLAN_IDLE
            return 0
        self._move(now)
        self.leg = (now, list(self.at), target, c.seconds)
        self.state = PLAN_LANDING if c.kind == "land" else PLAN_FLYING
        return 0

    def _move(self, now):
        if self.leg:
            begin, start, target, seconds = self.leg
            share = min(max((now - begin) / max(seconds, 1e-3), 0.0), 1.0)
            self.at = [a + share * (b - a) for a, b in zip(start, target, strict=True)]
            if share == 1.0 and self.state == PLAN_LANDING:
                self.state = PLAN_IDLE

    def _packet(self, index):
        t = index * 0.01
        self._move(t)
        unheard = any(a <= t < b for a, b in (*self.silent, *self.unheard))
        if self.lost.is_set() or unheard or self.random.random() < self.loss:
            return
        stamp = self.uptime_ms + index * 10
        if self.restart_at is not None and t > self.restart_at:
            stamp = int((t - self.restart_at) * 1000)
            if self.falls and not self.restarted:
                self.state, self.leg, self.at = PLAN_IDLE, None, [self.at[0], self.at[1], 0.0]
            self.restarted = True
        over = self.platform[0] <= self.at[0] <= self.platform[1]
        down = max(self.at[2] - (PLATFORM_M if over else 0.0), 0.01)
        pwm = FLYING_PWM if self.flying else 0
        values = {"acc.x": 0.0, "acc.y": 0.0, "acc.z": 1.0 + 0.01 * self.random.random(),
                  "gyro.x": self.random.random(), "gyro.y": 0.0, "gyro.z": 0.0, "range.zrange": int(1000 * down),
                  "pm.vbat": self.volts - 0.3 * self.flying}
        values |= {f"motor.m{i}": pwm for i in range(1, 5)}
        self.samples.put(Sample(blocks.MOTION.name, stamp % (1 << 24), self.now, values))
        if index % 5 == 0 and not (self.mute and self.restarted):
            slow = {name: 0 for name in blocks.STATE.names}
            slow |= {f"stateEstimateZ.{a}": int(1000 * v) for a, v in zip("xyz", self.at, strict=True)}
            slow |= {"stateEstimateZ.quat": 3 << 30, "supervisor.info": 0b1111 | self.flying << 4}
            self.samples.put(Sample(blocks.STATE.name, stamp % (1 << 24), self.now, slow))
