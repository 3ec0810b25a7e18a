// tests/web/browser.js: Debian's chromium without a window, for tests of the page. It is driven by the DevTools protocol
// over a pipe; nothing but node's own modules is needed. `node tests/web/browser_test.js` tries it.
//
//     const browser = await start({ width: 1280, height: 800 });
//     const page = browser.page;
//     await page.go('http://127.0.0.1:8000/');
//     await page.until('document.title === "ready"', 10);
//     await browser.stop();
'use strict';
const { spawn } = require('child_process');
const fs = require('fs');
const os = require('os');
const path = require('path');

const sleep = ms => new Promise(resolve => setTimeout(resolve, ms));

/// Commands to the browser and events from it, as JSON that ends with a NUL.
class Connection {
    constructor(child) {
        this.to = child.stdio[3];
        this.next = 1;
        this.waiting = new Map();
        this.listeners = [];
        this.ended = null;
        let parts = [];
        child.stdio[4].on('data', data => {
            let from = 0;
            for (let end; (end = data.indexOf(0, from)) >= 0; from = end + 1) {
                parts.push(data.subarray(from, end));
                this.take(JSON.parse(Buffer.concat(parts).toString()));
                parts = [];
            }
            parts.push(data.subarray(from));
        });
        for (const stream of [child.stdio[3], child.stdio[4]]) stream.on('error', () => {});
        child.on('exit', (code, signal) => this.end(`chromium has ended (${signal ?? code})`));
        child.on('error', error => this.end(`chromium cannot be started: ${error.message}`));
    }
    end(why) {
        this.ended ??= why;
        for (const { reject, method } of this.waiting.values()) reject(new Error(`${method}: ${why}`));
        this.waiting.clear();
    }
    take(message) {
        if (message.id === undefined) {
            for (const listener of this.listeners) listener(message);
            return;
        }
        const asked = this.waiting.get(message.id);
        this.waiting.delete(message.id);
        if (!asked) return;
        if (message.error) asked.reject(new Error(`${asked.method}: ${message.error.message}`));
        else asked.resolve(message.result);
    }
    send(method, params = {}, sessionId = undefined) {
        if (this.ended) return Promise.reject(new Error(`${method}: ${this.ended}`));
        return new Promise((resolve, reject) => {
            const id = this.next++;
            this.waiting.set(id, { resolve, reject, method });
            this.to.write(JSON.stringify({ id, method, params, sessionId }) + '\0');
        });
    }
}

/// What a keyboard of the US reports for a `code`, as KeyboardEvent names it: [key, key with Shift, virtual key].
const keys = {
    ArrowLeft: ['ArrowLeft', 'ArrowLeft', 37], ArrowUp: ['ArrowUp', 'ArrowUp', 38],
    ArrowRight: ['ArrowRight', 'ArrowRight', 39], ArrowDown: ['ArrowDown', 'ArrowDown', 40],
    Space: [' ', ' ', 32], Enter: ['Enter', 'Enter', 13], Escape: ['Escape', 'Escape', 27],
    Tab: ['Tab', 'Tab', 9], Backspace: ['Backspace', 'Backspace', 8], Delete: ['Delete', 'Delete', 46],
    Home: ['Home', 'Home', 36], End: ['End', 'End', 35], PageUp: ['PageUp', 'PageUp', 33],
    PageDown: ['PageDown', 'PageDown', 34],
    ShiftLeft: ['Shift', 'Shift', 16], ShiftRight: ['Shift', 'Shift', 16],
    ControlLeft: ['Control', 'Control', 17], ControlRight: ['Control', 'Control', 17],
    AltLeft: ['Alt', 'Alt', 18], AltRight: ['Alt', 'Alt', 18],
    Minus: ['-', '_', 189], Equal: ['=', '+', 187], Comma: [',', '<', 188], Period: ['.', '>', 190],
    Slash: ['/', '?', 191], Semicolon: [';', ':', 186], Quote: ['\'', '"', 222], Backslash: ['\\', '|', 220],
    BracketLeft: ['[', '{', 219], BracketRight: [']', '}', 221], Backquote: ['`', '~', 192],
};
for (const letter of 'ABCDEFGHIJKLMNOPQRSTUVWXYZ')
    keys[`Key${letter}`] = [letter.toLowerCase(), letter, letter.charCodeAt(0)];
for (let digit = 0; digit < 10; ++digit) {
    keys[`Digit${digit}`] = [`${digit}`, ')!@#$%^&*('[digit], 48 + digit];
    keys[`Numpad${digit}`] = [`${digit}`, `${digit}`, 96 + digit];
}
for (let f = 1; f <= 12; ++f) keys[`F${f}`] = [`F${f}`, `F${f}`, 111 + f];
const modifiers = { Alt: 1, Control: 2, Shift: 8 };

/// The text of an exception as the protocol describes it.
function exception_text(details) {
    const thrown = details.exception;
    return thrown?.description ?? (thrown && 'value' in thrown ? String(thrown.value) : details.text);
}

class Page {
    constructor(connection, session, child) {
        this.connection = connection;
        this.session = session;
        this.child = child;
        /// All that was said, in order: { type, text, url, worker, level }. Types are those of console.log and so on,
        /// 'exception', and 'network', 'security', … of the browser's own log, which has levels. What violates a content
        /// security policy is an error of 'security'. `worker` is the address of the worker that said it.
        this.console = [];
        this.sessions = new Map([[session, { type: 'page', url: '' }]]);  // of the page, its workers and their workers
        this.held = 0;  // modifier keys
        this.without_net = false;
        this.loads = 0;
        connection.listeners.push(event => this.take(event));
    }
    send(method, params) { return this.connection.send(method, params, this.session); }

    /// Sees what a page or worker says, also before its first line runs.
    async watch(session, type) {
        const send = (method, params) => this.connection.send(method, params, session);
        const asked = [send('Runtime.enable'), send('Log.enable'),
                       send('Target.setAutoAttach', { autoAttach: true, waitForDebuggerOnStart: true, flatten: true })];
        if (this.without_net || type === 'page') asked.push(send('Network.enable'));
        if (this.without_net) asked.push(this.cut(session));
        asked.push(send('Runtime.runIfWaitingForDebugger'));
        // A worker may lack a domain, or end meanwhile.
        await Promise.all(asked.map(one => one.catch(error => { if (type === 'page') throw error; })));
    }
    take({ method, params, sessionId }) {
        const from = this.sessions.get(sessionId);
        if (method === 'Target.attachedToTarget') {
            const { type, url } = params.targetInfo;
            if (!from) return;
            this.sessions.set(params.sessionId, { type, url });
            this.watch(params.sessionId, type);
            return;
        }
        if (method === 'Target.detachedFromTarget') this.sessions.delete(params.sessionId);
        if (!from) return;
        const worker = from.type === 'page' ? undefined : from.url || from.type;
        const said = (type, text, url, level) => this.console.push({ type, text, url, worker, level });
        if (method === 'Runtime.consoleAPICalled')
            said(params.type, params.args.map(a => 'value' in a && typeof a.value !== 'object' ? String(a.value)
                                                   : a.unserializableValue ?? a.description ?? JSON.stringify(a.value)).join(' '),
                 params.stackTrace?.callFrames[0]?.url);
        else if (method === 'Runtime.exceptionThrown')
            said('exception', exception_text(params.exceptionDetails), params.exceptionDetails.url);
        else if (method === 'Log.entryAdded') {
            const { source, text, url, level } = params.entry;
            if (source !== 'worker') said(source, text, url, level);  // else its own session says the same
        }
        else if (method === 'Page.loadEventFired') ++this.loads;
        else if (method === 'Inspector.targetCrashed') said('exception', 'the page has crashed');
    }
    /// What a test should fail for: exceptions, console.error, and what the browser reports.
    errors() {
        return this.console.filter(({ type, level }) => level === 'error' || ['exception', 'error', 'assert'].includes(type));
    }

    /// Returns when the page and what it names are loaded.
    async go(url) {
        const before = this.loads;
        const { errorText } = await this.send('Page.navigate', { url });
        if (errorText) throw new Error(`${url}: ${errorText}`);
        await this.loaded(before, url);
    }
    async reload() {
        const before = this.loads;
        await this.send('Page.reload');
        await this.loaded(before, 'the page');
    }
    async loaded(before, what) {
        for (const end = Date.now() + 60000; this.loads === before; await sleep(10))
            if (Date.now() > end) throw new Error(`${what} has not loaded within 60 s`);
    }

    /// The value of an expression, as JSON carries it; of a promise, what it gives.
    async eval(expression) {
        const { result, exceptionDetails } = await this.send(
            'Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true, userGesture: true });
        if (exceptionDetails) throw new Error(`${exception_text(exceptionDetails)} (in ${expression})`);
        return result.value;
    }
    /// Waits until an expression is true and returns its value.
    async until(expression, seconds = 10) {
        let last;
        for (const end = Date.now() + 1000 * seconds; Date.now() < end; await sleep(20)) {
            try {
                last = await this.eval(expression);
                if (last) return last;
            } catch (error) {
                if (this.connection.ended) throw error;
                last = error.message;
            }
        }
        const said = this.errors().slice(-3).map(e => e.text).join('; ');
        throw new Error(`waited ${seconds} s for ${expression}, which is ${JSON.stringify(last)}${said && `; the page says: ${said}`}`);
    }

    /// Presses the key of this code ('KeyA', 'ArrowUp', 'F1', 'ShiftLeft') and lets it go after `hold` ms; only the one with
    /// { down: true } or { up: true }.
    async key(code, { down = false, up = false, hold = 30 } = {}) {
        const known = keys[code];
        if (!known) throw new Error(`no key has the code ${code}`);
        const [plain, shifted, windowsVirtualKeyCode] = known;
        const modifier = modifiers[plain] ?? 0;
        const send = (type, text) => this.send('Input.dispatchKeyEvent', {
            type, code, key: this.held & modifiers.Shift ? shifted : plain, windowsVirtualKeyCode, modifiers: this.held, text,
            nativeVirtualKeyCode: windowsVirtualKeyCode, isKeypad: code.startsWith('Numpad'),
            location: /^(Shift|Control|Alt)/.test(code) ? (code.endsWith('Left') ? 1 : 2) : 0 });
        const both = down === up;
        if (both || down) {
            this.held |= modifier;
            const key = this.held & modifiers.Shift ? shifted : plain;
            const text = key.length === 1 && !(this.held & (modifiers.Control | modifiers.Alt)) ? key
                         : code === 'Enter' ? '\r' : undefined;
            await send(text ? 'keyDown' : 'rawKeyDown', text);
        }
        if (both) await sleep(hold);
        if (both || up) {
            this.held &= ~modifier;
            await send('keyUp');
        }
    }
    /// Clicks on the middle of an element, after it has scrolled into view.
    async click(selector, { button = 'left' } = {}) {
        const place = await this.eval(`(() => {
            const found = document.querySelector(${JSON.stringify(selector)});
            if (!found) return null;
            found.scrollIntoView({ block: 'nearest', inline: 'nearest', behavior: 'instant' });
            const box = found.getBoundingClientRect(), x = box.left + box.width / 2, y = box.top + box.height / 2;
            const top = document.elementFromPoint(x, y);
            return { x, y, reached: box.width > 0 && !!top && (found === top || found.contains(top) || top.contains(found)) };
        })()`);
        if (!place) throw new Error(`the page has no ${selector}`);
        if (!place.reached) throw new Error(`${selector} is hidden, or another element covers it`);
        const mouse = (type, clickCount, buttons) => this.send(
            'Input.dispatchMouseEvent', { type, x: place.x, y: place.y, button, buttons, clickCount, modifiers: this.held });
        await mouse('mouseMoved', 0, 0);
        await mouse('mousePressed', 1, button === 'right' ? 2 : 1);
        await mouse('mouseReleased', 1, 0);
    }
    size(width, height, scale = 1) {
        return this.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: scale, mobile: false });
    }
    async emulate({ colorScheme, reducedMotion, touch } = {}) {
        const features = [];
        if (colorScheme !== undefined) features.push({ name: 'prefers-color-scheme', value: colorScheme });
        if (reducedMotion !== undefined) features.push({ name: 'prefers-reduced-motion', value: reducedMotion });
        if (features.length) await this.send('Emulation.setEmulatedMedia', { features });
        if (touch !== undefined)
            await this.send('Emulation.setTouchEmulationEnabled', { enabled: touch, maxTouchPoints: touch ? 5 : 1 });
    }
    async screenshot(file) {
        const { data } = await this.send('Page.captureScreenshot', { format: 'png' });
        fs.writeFileSync(file, Buffer.from(data, 'base64'));
    }

    cut(session) {
        return this.connection.send('Network.emulateNetworkConditions',
            { offline: this.without_net, latency: 0, downloadThroughput: -1, uploadThroughput: -1 }, session);
    }
    /// Without a network or with one again, for the page, its workers and its service worker.
    async offline(without) {
        this.without_net = without;
        for (const [session, { type }] of this.sessions)
            await this.connection.send('Network.enable', {}, session).then(() => this.cut(session))
                .catch(error => { if (type === 'page') throw error; });
    }

    /// Bytes: { heap, processes: [{ pid, type, rss, pss }], rss, pss }. The heap is that of the page's JavaScript, without
    /// its workers'. `pss` counts a page that n processes share as 1/n.
    async memory() {
        const { usedSize } = await this.send('Runtime.getHeapUsage');
        const processes = [];
        for (const pid of tree(this.child.pid)) {
            try {
                const rollup = fs.readFileSync(`/proc/${pid}/smaps_rollup`, 'utf8');
                const line = fs.readFileSync(`/proc/${pid}/cmdline`, 'utf8');
                const of = name => 1024 * Number(rollup.match(new RegExp(`^${name}:\\s+(\\d+) kB`, 'm'))?.[1] ?? 0);
                const type = line.match(/--type=([a-z-]+)/)?.[1] ?? 'browser';
                processes.push({ pid, type, rss: of('Rss'), pss: of('Pss') });
            } catch (error) {
                if (!['ENOENT', 'ESRCH', 'EACCES'].includes(error.code)) throw error;  // it has ended
            }
        }
        const sum = of => processes.reduce((all, one) => all + one[of], 0);
        return { heap: usedSize, processes, rss: sum('rss'), pss: sum('pss') };
    }
}

/// A process and those that it has started, directly or not.
function tree(root) {
    const children = new Map();
    for (const name of fs.readdirSync('/proc')) {
        if (!/^\d+$/.test(name)) continue;
        try {
            const stat = fs.readFileSync(`/proc/${name}/stat`, 'utf8');
            const parent = Number(stat.slice(stat.lastIndexOf(')') + 2).split(' ')[1]);
            children.set(parent, [...(children.get(parent) ?? []), Number(name)]);
        } catch { /* it has ended */ }
    }
    const all = [root];
    for (let i = 0; i < all.length; ++i) all.push(...(children.get(all[i]) ?? []));
    return all;
}

/// Starts chromium with an empty page. `profile` keeps a profile that the caller owns; else it is made and removed.
async function start({ flags = [], width = 1280, height = 800, profile } = {}) {
    const folder = profile ?? fs.mkdtempSync(path.join(os.tmpdir(), 'seldinger-browser-'));
    const child = spawn('/usr/bin/chromium', [
        '--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
        '--remote-debugging-pipe', `--user-data-dir=${folder}`, `--window-size=${width},${height}`, '--no-first-run',
        '--no-default-browser-check', '--disable-background-networking', '--disable-component-update', '--disable-sync',
        '--disable-extensions', '--disable-breakpad', '--disable-crash-reporter', '--disable-dev-shm-usage', '--mute-audio',
        '--force-color-profile=srgb', '--hide-scrollbars', ...flags, 'about:blank'],
        { stdio: ['ignore', 'ignore', 'pipe', 'pipe', 'pipe'], detached: true });  // a group of its own, to be ended as one
    let said = '';
    child.stderr.on('data', data => { said = (said + data).slice(-4000); });
    const kill = () => {
        if (child.pid === undefined || child.exitCode !== null || child.signalCode !== null) return;  // its own end with it
        const all = tree(child.pid);
        try { process.kill(-child.pid, 'SIGKILL'); } catch { /* it has ended */ }
        for (const pid of all) try { process.kill(pid, 'SIGKILL'); } catch { /* it has ended */ }
    };
    const at_exit = () => {
        kill();
        if (!profile) try { fs.rmSync(folder, { recursive: true, force: true }); } catch { /* best effort */ }
    };
    const at_signal = () => process.exit(1);
    process.on('exit', at_exit);
    process.on('SIGINT', at_signal);
    process.on('SIGTERM', at_signal);
    const stop = async () => {
        const ended = child.exitCode !== null || child.signalCode !== null || child.pid === undefined
                      ? Promise.resolve() : new Promise(resolve => child.once('exit', resolve));
        if (profile && !connection.ended) {  // one that is kept is written down first
            await Promise.race([connection.send('Browser.close').catch(() => {}), sleep(3000)]);
            await Promise.race([ended, sleep(3000)]);
        }
        kill();
        await Promise.race([ended, sleep(5000)]);
        if (!profile) fs.rmSync(folder, { recursive: true, force: true, maxRetries: 10, retryDelay: 50 });
        process.off('exit', at_exit);
        process.off('SIGINT', at_signal);
        process.off('SIGTERM', at_signal);
    };
    const connection = new Connection(child);
    try {
        const late = setTimeout(() => connection.end('chromium has not answered within 60 s'), 60000);
        const { targetInfos } = await connection.send('Target.getTargets');
        const target = targetInfos.find(info => info.type === 'page')
                       ?? await connection.send('Target.createTarget', { url: 'about:blank' });
        const { sessionId } = await connection.send('Target.attachToTarget', { targetId: target.targetId, flatten: true });
        clearTimeout(late);
        const page = new Page(connection, sessionId, child);
        await page.send('Page.enable');
        await page.watch(sessionId, 'page');
        await page.size(width, height);
        return { page, stop, connection };
    } catch (error) {
        await stop();
        throw new Error(`${error.message}${said && `; it says: ${said.trim()}`}`);
    }
}

module.exports = { start, keys };
