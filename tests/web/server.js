// tests/web/server.js: serves a folder at 127.0.0.1 for tests of the page. `node tests/web/server.js FOLDER [PORT]` prints the
// port. A test that requires it can count, damage, delay, remove and replace files.
'use strict';
const crypto = require('crypto');
const fs = require('fs');
const http = require('http');
const path = require('path');

const types = {
    '.html': 'text/html; charset=utf-8', '.js': 'text/javascript; charset=utf-8', '.mjs': 'text/javascript; charset=utf-8',
    '.css': 'text/css; charset=utf-8', '.json': 'application/json', '.webmanifest': 'application/manifest+json',
    '.wasm': 'application/wasm', '.svg': 'image/svg+xml', '.png': 'image/png', '.ico': 'image/x-icon',
    '.txt': 'text/plain; charset=utf-8', '.md': 'text/plain; charset=utf-8', '.woff2': 'font/woff2',
    '.gz': 'application/gzip', '.bin': 'application/octet-stream',
};

/// Of files whose name starts with a dot and of what lies outside the folder, nothing is served.
function file_of(folder, name) {
    if (name.split('/').some(part => part.startsWith('.')) || name.includes('\0')) return null;
    const file = path.join(folder, name.endsWith('/') ? `${name}index.html` : name);
    return fs.statSync(file, { throwIfNoEntry: false })?.isFile() ? file : null;
}

/// Paths are those of requests, '/engine.wasm'; '/' is not the same as '/index.html'.
class Server {
    constructor(folder, headers) {
        this.folder = path.resolve(folder);
        this.headers = headers;  // for all answers, such as those that a host would send
        this.counts = new Map();  // path → { asked, sent, unchanged, bytes }
        this.acts = new Map();
        this.http = http.createServer((request, response) => {
            this.answer(request, response).catch(error => {
                if (!response.headersSent) response.writeHead(500);
                response.end(error.message);
            });
        });
    }
    /// Changes how a path is answered, until `restore`: `change` gets the bytes and returns others, `delay` [ms] waits before
    /// the answer, `rate` [bytes/s] slows it, `cut` closes the connection after so many bytes, `status` is sent alone.
    act(name, { change, delay, rate, cut, status }) { this.acts.set(name, { change, delay, rate, cut, status }); }
    /// One bit of the byte at `at` is wrong.
    corrupt(name, at = 0) {
        this.act(name, { change: bytes => { const wrong = Buffer.from(bytes); wrong[at % wrong.length] ^= 1; return wrong; } });
    }
    delay(name, ms) { this.act(name, { delay: ms }); }
    restore(name) { name === undefined ? this.acts.clear() : this.acts.delete(name); }
    asked(name) { return this.counts.get(name)?.asked ?? 0; }
    forget() { this.counts.clear(); }

    async answer(request, response) {
        let name;
        try {
            name = decodeURIComponent(new URL(request.url, 'http://here').pathname);
        } catch {
            response.writeHead(400).end();
            return;
        }
        const count = this.counts.get(name) ?? { asked: 0, sent: 0, unchanged: 0, bytes: 0 };
        this.counts.set(name, count);
        ++count.asked;
        const act = this.acts.get(name) ?? {};
        if (act.delay) await new Promise(resolve => setTimeout(resolve, act.delay));
        const file = file_of(this.folder, name);
        if (act.status || !file || !['GET', 'HEAD'].includes(request.method)) {
            response.writeHead(act.status ?? (file ? 405 : 404), { ...this.headers, 'Content-Type': 'text/plain' });
            response.end(`${name}: ${act.status ?? 'not here'}\n`);
            return;
        }
        let bytes = await fs.promises.readFile(file);
        if (act.change) bytes = act.change(bytes);
        const tag = `"${crypto.createHash('sha256').update(bytes).digest('base64url').slice(0, 22)}"`;
        const head = { ...this.headers, ETag: tag };
        if (request.headers['if-none-match'] === tag) {
            ++count.unchanged;
            response.writeHead(304, head).end();
            return;
        }
        head['Content-Type'] = types[path.extname(file).toLowerCase()] ?? 'application/octet-stream';
        head['Content-Length'] = bytes.length;
        response.writeHead(200, head);
        if (request.method === 'HEAD') return void response.end();
        ++count.sent;
        const step = act.rate ? Math.max(1, Math.ceil(act.rate / 20)) : bytes.length;
        for (let from = 0; from < bytes.length && !response.destroyed; from += step) {
            const to = Math.min(from + step, act.cut ?? bytes.length, bytes.length);
            if (to > from) response.write(bytes.subarray(from, to));
            count.bytes += Math.max(0, to - from);
            if (act.cut !== undefined && to >= act.cut) {
                await new Promise(resolve => setTimeout(resolve, 50));  // so that what was written arrives
                return void response.destroy();
            }
            if (act.rate) await new Promise(resolve => setTimeout(resolve, 50));
        }
        response.end();
    }
    stop() {
        this.http.closeAllConnections();
        return new Promise(resolve => this.http.close(resolve));
    }
}

/// { port, url, act, corrupt, delay, restore, counts, asked, forget, stop }
async function serve(folder, { port = 0, headers = {} } = {}) {
    const server = new Server(folder, headers);
    await new Promise((resolve, reject) => {
        server.http.once('error', reject);
        server.http.listen(port, '127.0.0.1', resolve);
    });
    server.port = server.http.address().port;
    server.url = `http://127.0.0.1:${server.port}/`;
    return server;
}

module.exports = { serve };

if (require.main === module) {
    const [folder, port = '0'] = process.argv.slice(2);
    if (!folder || !/^\d+$/.test(port)) {
        console.error('usage: node tests/web/server.js FOLDER [PORT]');
        process.exit(2);
    }
    serve(folder, { port: Number(port) }).then(server => console.log(server.port),
                                               error => { console.error(error.message); process.exit(2); });
}
