"""A device of emtb that moves: `driver: program` with `moves: true`, docs/wiring/program.md.

    toy_motor.py [SAFE]       [V] that is safe at the driver's input

The four things that every program with an output must do are numbered. The motor is made of two lines: put your
hardware in its place.
"""
import math
import os
import select
import sys
import time

WATCHDOG = 0.2  # [s] without a `set`, after which the output is made safe
PERIOD = 0.01  # [s] between readings


class Motor:
    """Behind a driver of 2 V/V, without a load: 20 rad/s a volt, after 0.2 s."""

    def __init__(self):
        self.u, self.omega = 0.0, 0.0

    def set(self, volts):
        self.u = volts

    def turn(self, seconds):
        self.omega += (2 * self.u / 0.05 - self.omega) * (1 - math.exp(-seconds / 0.2))


def main(safe="0"):
    motor, safe = Motor(), float(safe)
    motor.set(safe)  # 1. safe before anything else
    print("emtb 1 toy motor")
    turned = told = time.monotonic()
    begun = b""
    while True:
        ready = select.select([0], [], [], PERIOD)[0]
        now = time.monotonic()
        if ready:
            got = os.read(0, 4096)
            if not got:  # 2. emtbd has gone: safe, and the end
                motor.set(safe)
                return
            *lines, begun = (begun + got).split(b"\n")
            for line in lines:
                if line.startswith(b"set "):
                    motor.set(float(line[4:]))
                    told = now
        if now - told > WATCHDOG:  # 3. emtbd hangs: safe
            motor.set(safe)
        print(f"out={motor.u:.6g}")  # 4. what stands at the output
        if now - turned >= PERIOD:
            motor.turn(now - turned)
            turned = now
            print(f"e_a={2 * motor.u:.6g} omega={motor.omega:.6g} t={now:.6f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
