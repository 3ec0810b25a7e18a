"""python3 tests/web/firefox.py FOLDER PROGRAM PICTURES: the page in Firefox, whose compiler, graphics and input are others than
Chromium's. A whole exercise by keys, over WebDriver BiDi; the recording must reach the same states in the program. Code 1
where something is not as promised."""

import asyncio
import base64
import functools
import http.server
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

import websockets

FOLDER, PROGRAM, PICTURES = (pathlib.Path(given).resolve() for given in sys.argv[1:4])
SPACE, UP, ENTER, END = " ", "\ue013", "\ue007", "\ue010"  # as WebDriver names keys


class Silent(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class Firefox:
    """A window of Firefox that nobody sees, at `url`."""

    def __init__(self, socket, process):
        self.socket, self.process = socket, process
        self.asked, self.complaints, self.context = 0, [], None

    @classmethod
    async def start(cls, profile):
        process = subprocess.Popen(
            ["firefox-esr", "--headless", "--remote-debugging-port=0", "--profile", profile, "--width=1280", "--height=800"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        address = None
        for line in process.stderr:
            found = re.search(r"WebDriver BiDi listening on (ws://\S+)", line)
            if found:
                address = found[1]
                break
        if address is None:
            raise RuntimeError("expected Firefox to open a port for WebDriver BiDi, found that it has ended")
        threading.Thread(target=process.stderr.read, daemon=True).start()
        self = cls(await websockets.connect(address + "/session", max_size=1 << 28), process)
        await self.send("session.new", capabilities={})
        await self.send("session.subscribe", events=["log.entryAdded"])
        self.context = (await self.send("browsingContext.getTree"))["contexts"][0]["context"]
        return self

    async def send(self, method, **params):
        self.asked += 1
        await self.socket.send(json.dumps({"id": self.asked, "method": method, "params": params}))
        while True:
            said = json.loads(await self.socket.recv())
            if said.get("method") == "log.entryAdded" and said["params"]["level"] in ("warn", "error"):
                self.complaints.append(said["params"]["text"])
            if said.get("id") == self.asked:
                if said["type"] == "error":
                    raise RuntimeError(f"{method}: {said['message']}")
                return said["result"]

    async def go(self, url):
        await self.send("browsingContext.navigate", context=self.context, url=url, wait="complete")

    async def eval(self, text):
        said = await self.send("script.evaluate", expression=text, target={"context": self.context}, awaitPromise=True)
        if said["type"] != "success":
            raise RuntimeError(f"{text}: {said['exceptionDetails']['text']}")
        return said["result"].get("value")

    async def until(self, text, seconds):
        """Whole seconds of waiting, until the text is true in the page."""
        begun = time.monotonic()
        while not await self.eval(f"Boolean({text})"):
            if time.monotonic() - begun > seconds:
                raise RuntimeError(f"expected {text} within {seconds} s")
            await asyncio.sleep(0.1)
        return time.monotonic() - begun

    async def keys(self, *actions):
        await self.send("input.performActions", context=self.context,
                        actions=[{"type": "key", "id": "keys", "actions": list(actions)}])

    async def screenshot(self, name):
        shot = await self.send("browsingContext.captureScreenshot", context=self.context)
        (PICTURES / name).write_bytes(base64.b64decode(shot["data"]))


def down(key):
    return {"type": "keyDown", "value": key}


def up(key):
    return {"type": "keyUp", "value": key}


async def opened(firefox, url, name):
    await firefox.go(url)
    await firefox.until(f"document.querySelector('[data-exercise={name}]')", 60)
    start = f"document.querySelector('[data-exercise={name}] .first')"
    await firefox.eval(f"{start} || document.getElementById('open-all').click()")
    await firefox.eval(f"{start}.click()")
    seconds = await firefox.until("document.getElementById('start').offsetParent && !document.getElementById('start').disabled", 60)
    print(f"firefox: the briefing of '{name}' is complete after {seconds:.1f} s")
    await firefox.eval("document.getElementById('start').click()")
    await firefox.until("document.body.dataset.screen === 'room'", 10)


SAVED = """(async () => {
    const blobs = [], made = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
    URL.createObjectURL = blob => { blobs.push(blob); return made(blob); };
    HTMLAnchorElement.prototype.click = () => {};
    document.getElementById('download').click();
    for (let k = 0; k < 50 && blobs.length === 0; ++k) await new Promise(resolve => setTimeout(resolve, 100));
    let text = '';
    for (const byte of new Uint8Array(await blobs[0].arrayBuffer())) text += String.fromCharCode(byte);
    return btoa(text);
})()"""


async def try_page(url, work):
    profile = work / "profile"
    profile.mkdir()
    firefox = await Firefox.start(str(profile))
    try:
        await opened(firefox, url, "straight")
        await firefox.keys(down(SPACE), down(UP))
        await firefox.until("document.body.dataset.screen === 'end'", 60)
        await firefox.keys(up(SPACE), up(UP))
        title = await firefox.eval("document.querySelector('#end h1').textContent")
        if not title.startswith("Target reached"):
            raise RuntimeError(f"expected 'Target reached' after the wire was pushed, found '{title}'")
        await firefox.screenshot("firefox-end.png")
        recording = work / "straight-001.gw"
        recording.write_bytes(base64.b64decode(await firefox.eval(SAVED)))
        replayed = subprocess.run([PROGRAM, "replay", recording, "--cache", work / "cache"], capture_output=True, text=True)
        print(f"firefox: {replayed.stdout.strip()}")
        if replayed.returncode != 0 or "all equal" not in replayed.stdout:
            raise RuntimeError(f"expected states that the program reaches too, found: {replayed.stdout}{replayed.stderr}")
        await opened(firefox, url, "renal")
        await firefox.keys(down(SPACE), down(UP), {"type": "pause", "duration": 5000})
        await firefox.screenshot("firefox-room.png")
        await firefox.keys(up(SPACE), up(UP))
        if firefox.complaints:
            raise RuntimeError("expected a silent console, found: " + "; ".join(firefox.complaints))
        print("firefox: as promised")
    finally:
        firefox.process.terminate()
        firefox.process.wait()


def main():
    PICTURES.mkdir(parents=True, exist_ok=True)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Silent, directory=FOLDER))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tempfile.TemporaryDirectory() as work:
        try:
            asyncio.run(try_page(f"http://127.0.0.1:{server.server_port}/index.html", pathlib.Path(work)))
        except RuntimeError as error:
            print(f"firefox: {error}")
            return 1
    return 0


sys.exit(main())
