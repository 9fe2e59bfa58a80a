#!/usr/bin/env python3
"""Sends what a bench measures, live, to PlotJuggler: plotjuggler.py [SOCKET_OF_EMTBD [PORT]]

In PlotJuggler: Streaming, UDP Server, port 9870, protocol JSON, "use the field timestamp". Its side was not tried.
"""
import json
import pathlib
import socket
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python"))
import emtb  # noqa: E402


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else None
    port = int(sys.argv[2]) if len(sys.argv) > 2 else 9870
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with emtb.Bench(path) as bench:
        for reading in bench.live(rate=50):
            values = {name: value for name, value in reading.items() if value is not None}
            message = {"timestamp": time.time(), "bench": values}
            out.sendto(json.dumps(message).encode(), ("127.0.0.1", port))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
    except emtb.BenchError as error:
        sys.exit(str(error))
