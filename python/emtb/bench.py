"""emtbd by its socket: JSON-RPC 2.0, one object a line (docs/protocol.md)."""
import json
import os
import pathlib
import socket


PROTOCOL = 1  # members are only added to it


class BenchError(RuntimeError):
    """What the daemon refused. `code` is of docs/protocol.md, 0 where nobody answered."""

    def __init__(self, message, code=0, data=None):
        super().__init__(message)
        self.code, self.data = code, data


def usual_socket():
    """Where the daemon listens unless it was told otherwise."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    mine = pathlib.Path(runtime, "emtb.sock") if runtime else None
    return mine if mine and mine.exists() else pathlib.Path("/run/emtb/emtb.sock")


class Bench:
    """A connection to the daemon. The run that it began ends when it is closed: with a motor that turns, keep it open."""

    def __init__(self, path=None, timeout=20.0):
        """path: of the socket. timeout [s]: for each answer."""
        self.path = pathlib.Path(path) if path else usual_socket()
        self._timeout, self._last, self._unread, self._ended = timeout, 0, b"", []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.connect(str(self.path))
        except OSError as error:
            self._socket.close()
            raise BenchError(f"no daemon answers at {self.path} ({error.strerror}): start emtbd --config BENCH.yaml") from None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._socket.close()

    def _line(self, timeout):
        self._socket.settimeout(timeout)
        while b"\n" not in self._unread:
            try:
                more = self._socket.recv(65536)
            except socket.timeout:
                raise BenchError(f"the daemon at {self.path} has not answered for {timeout:g} s") from None
            if not more:
                raise BenchError(f"the daemon at {self.path} closed the connection")
            self._unread += more
        line, self._unread = self._unread.split(b"\n", 1)
        message = json.loads(line)
        if message.get("method") == "ended":
            self._ended.append(message["params"])
        return message

    def ask(self, method, **parameters):
        """The result of any method of the protocol. Raises BenchError where the daemon refuses."""
        self._last += 1
        request = {"jsonrpc": "2.0", "id": self._last, "method": method}
        if parameters:
            request["params"] = parameters
        self._socket.sendall(json.dumps(request).encode() + b"\n")
        while True:
            message = self._line(self._timeout)
            if message.get("id") != self._last:
                continue
            if "error" in message:
                error = message["error"]
                raise BenchError(error["message"], error["code"], error.get("data"))
            return message["result"]

    def status(self):
        answer = self.ask("status")
        if answer.get("protocol", PROTOCOL) > PROTOCOL:
            raise BenchError(f"the daemon at {self.path} was made by a newer emtb: it speaks protocol "
                             f"{answer['protocol']}, this package {PROTOCOL}. Update the package")
        return answer

    def reset(self):
        """Arms the bench, where no cause against it stands. See that it is safe first."""
        self.status()  # of a protocol that is known
        return self.ask("reset")

    def run(self, profile, note="", brake=""):
        """Runs a profile (its name, its file, or its text) to its end. Returns the session's path.

        Raises BenchError where it is refused, and where the run ends by a fault.
        """
        path = pathlib.Path(profile) if "\n" not in profile else None
        if path and path.suffix in (".yaml", ".yml"):
            profile = path.read_text()
        self.status()
        self.ask("subscribe", rate=1)
        texts = {name: text for name, text in (("note", note), ("brake", brake)) if text}
        begun = self.ask("run", profile=profile, **texts)
        patience = begun["duration"] + 600  # a pause may wait for a person
        while True:
            for ended in self._ended:
                if ended["run"] == begun["run"]:
                    self._ended.remove(ended)
                    if ended["outcome"] == "fault":
                        fault = ended["fault"] or {}
                        raise BenchError(f"the run ended: {fault.get('text', 'fault')}", fault.get("code", 0), ended)
                    return ended["session"]
            self._line(patience)

    def live(self, rate=20):
        """Yields the newest reading of each signal, {name: value}, `rate` times a second, for ever."""
        self.ask("subscribe", rate=rate)
        while True:
            message = self._line(self._timeout)
            if message.get("method") == "live":
                yield message["params"]["signals"]

    def stop(self):
        """Ends whatever run is on. To connect to SOCKET.stop is to stop: nothing that was asked before delays it."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stopping:
            stopping.settimeout(self._timeout)
            stopping.connect(str(self.path) + ".stop")
            return json.loads(stopping.makefile().readline())
