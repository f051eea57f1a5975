"""Clients of `tricoil serve`: hostile clients, and one that reads the stream of the live page."""
import http.client
import json
import os
import socket
import threading
import time


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=5)


def flood(port, random, seconds):
    """Sends requests and does not read the replies."""
    with connect(port) as line:
        line.settimeout(0.2)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                line.sendall(random.choice([b"P", b"PS\x16", b"C", b"O1,2,4\r"]) * 100)
            except (socket.timeout, BrokenPipeError, ConnectionResetError):
                time.sleep(0.01)


def babble(port, random, seconds):
    """Connects repeatedly, sends random bytes and disconnects."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            with connect(port) as line:
                line.sendall(random.randbytes(random.randrange(1, 3000)))
                line.settimeout(0.05)
                line.recv(100)
        except OSError:
            pass
        time.sleep(0.02)


REQUESTS = [
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nRange: bytes=0-99999999\r\n\r\n",
    b"GET /" + b"a" * 300 + b" HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n",
    b"POST /control HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Type: application/json\r\nContent-Length: 14\r\n\r\n{\"run\": false}",
    b"POST /control HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nX: ",  # never ends
    b"GET /stream HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n",  # never read
    b"HEAD / HTTP/1.1\r\nHost: evil.example\r\n\r\n",
]


def browse(port, random, seconds):
    """Sends requests of REQUESTS on up to ten connections at a time."""
    lines, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            line = connect(port)
            request = random.choice(REQUESTS)
            line.sendall(request % port if b"%d" in request else request)
            lines.append(line)
        except OSError:
            pass
        while len(lines) > 10:
            lines.pop(random.randrange(len(lines))).close()
        time.sleep(0.02)
    for line in lines:
        line.close()


def get(port, path, token):
    """Body of the page's answer to a request with the token."""
    return request(port, "GET", path, token)


def control(port, command, token):
    """Executes a control request. Returns the page's answer."""
    return request(port, "POST", "/control", token, json.dumps(command))


def request(port, method, path, token, body=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    try:
        connection.request(method, path, body, {"Authorization": f"Bearer {token}", "Content-Type": "application/json"})
        answer = connection.getresponse()
        text = answer.read().decode()
    finally:
        connection.close()
    if answer.status != 200:
        raise ValueError(f"{method} {path}: {answer.status}: {text}")
    return text


class Page(threading.Thread):
    """Reads the live page's stream, as a browser does; counts events and valid poses."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.port, self.events, self.valid, self.warnings, self.ends = port, 0, 0, set(), False
        self.came = time.monotonic()

    def run(self):
        while not self.ends:
            try:
                self.read()
            except (OSError, ValueError):
                time.sleep(0.1)

    def read(self):
        with connect(self.port) as line:
            line.sendall(b"GET /stream HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n" % self.port)
            hello = {}
            for text in line.makefile("rb"):
                if self.ends:
                    return
                if text.startswith(b"data: "):
                    event = json.loads(text[6:])
                    self.events += 1
                    hello = event.get("hello", hello)
                    flags = hello["columns"].index("flags")
                    self.valid += any(pose[flags] & hello["invalidating"] == 0 for pose in event["poses"])
                    self.warnings.add(event["status"].get("health", {}).get("warning", ""))
                    self.came = time.monotonic()


def use_of(process):
    """Resident kilobytes, descriptors, threads of a process."""
    with open(f"/proc/{process}/status") as status:
        fields = dict(line.split(":", 1) for line in status)
    return int(fields["VmRSS"].split()[0]), len(os.listdir(f"/proc/{process}/fd")), int(fields["Threads"])
