"""A meter on the network (SCPI over TCP) as a device of emtb: `driver: program`, docs/wiring/program.md.

    scpi_over_tcp.py HOST[:PORT] SIGNAL QUERY [PERIOD]     e.g. 192.168.1.20 i_a "MEAS:CURR:DC?" 0.2
"""
import os
import select
import socket
import sys
import time


def rest(until):
    """Waits; ends with emtbd, which is when our stdin ends."""
    while (left := until - time.monotonic()) > 0:
        if select.select([0], [], [], left)[0] and not os.read(0, 4096):
            sys.exit(0)


def main(host, signal, query, period="0.2"):
    host, _, port = host.partition(":")
    meter = socket.create_connection((host, int(port or 5025)), timeout=2)
    answers = meter.makefile("r", encoding="ascii")

    def ask(question):
        meter.sendall(question.encode("ascii") + b"\n")
        return answers.readline().strip() or sys.exit("the meter has closed the connection")

    print("emtb 1", ask("*IDN?"))  # the hello: from now on there are readings
    while True:
        asked = time.monotonic()
        value = float(ask(query))
        if abs(value) >= 9e37:  # what SCPI meters answer beyond their range
            print("fault over_range")
        else:
            print(f"{signal}={value} t={(asked + time.monotonic()) / 2:.6f}")
        rest(asked + float(period))


if __name__ == "__main__":
    main(*sys.argv[1:])
