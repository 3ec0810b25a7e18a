// node tests/web/browser_test.js: tries browser.js and server.js with a page of its own: WebGL 2 in a worker, as the page of
// the simulator needs it, keys, the mouse, what workers say, a page without a network, a damaged file. Takes some seconds.
'use strict';
const assert = require('assert');
const fs = require('fs');
const os = require('os');
const path = require('path');
const { start } = require('./browser.js');
const { serve } = require('./server.js');

const files = {
    'index.html': `<!DOCTYPE html><meta charset="utf-8"><title>trial</title><link rel="icon" href="data:,">
<style>body { margin: 0; background: white } @media (prefers-color-scheme: dark) { body { background: black } }</style>
<canvas id="seen" width="64" height="64"></canvas><button id="press">press</button><script src="page.js"></script>`,
    'page.js': `
const seen = { keys: [], clicks: 0, drawn: null };
for (const type of ['keydown', 'keyup'])
    addEventListener(type, e => seen.keys.push([type, e.key, e.code, e.keyCode, e.shiftKey, performance.now()]));
document.getElementById('press').onclick = e => seen.clicks += e.isTrusted;
const worker = new Worker('worker.js');
worker.onmessage = e => seen.drawn = e.data;
const canvas = document.getElementById('seen').transferControlToOffscreen();
worker.postMessage(canvas, [canvas]);
if ('serviceWorker' in navigator) navigator.serviceWorker.register('keeper.js');`,
    // Adds 1 and 2 in a texture of floats by blending, as path lengths are added.
    'worker.js': `
console.log('the worker runs');
onmessage = e => {
    const gl = e.data.getContext('webgl2');
    const extensions = ['EXT_color_buffer_float', 'EXT_float_blend'].map(name => !!gl.getExtension(name));
    const shader = (type, text) => { const s = gl.createShader(type); gl.shaderSource(s, text); gl.compileShader(s); return s; };
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, \`#version 300 es
        void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, \`#version 300 es
        precision highp float; uniform float v; out vec4 c; void main() { c = vec4(v, 0.0, 0.0, 1.0); }\`));
    gl.linkProgram(program);
    gl.useProgram(program);
    const v = gl.getUniformLocation(program, 'v');
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 64, 64);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
    gl.viewport(0, 0, 64, 64);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    for (const value of [1, 2]) { gl.uniform1f(v, value); gl.drawArrays(gl.TRIANGLES, 0, 3); }
    const sum = new Float32Array(4);
    gl.readPixels(31, 31, 1, 1, gl.RGBA, gl.FLOAT, sum);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.BLEND);
    gl.clearColor(1, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    postMessage({ extensions, sum: sum[0], error: gl.getError() });
    setTimeout(() => { throw new Error('thrown in the worker'); });
};`,
    'keeper.js': `
oninstall = e => e.waitUntil(caches.open('1').then(c => c.addAll(['./', 'page.js', 'worker.js'])).then(() => skipWaiting()));
onactivate = e => e.waitUntil(clients.claim());
onfetch = e => e.respondWith(caches.match(e.request).then(kept => kept || fetch(e.request)));`,
    'strict.html': '<!DOCTYPE html><meta http-equiv="Content-Security-Policy" content="script-src \'self\'"><script>1</script>',
    'some.wasm': Buffer.from([0, 0x61, 0x73, 0x6d, 1, 0, 0, 0]),
};

async function main() {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'seldinger-trial-'));
    let server, browser;
    try {
        for (const [name, text] of Object.entries(files)) fs.writeFileSync(path.join(folder, name), text);
        server = await serve(folder);
        browser = await start({ width: 400, height: 300 });
        const page = browser.page;
        await page.go(server.url);

        assert.deepStrictEqual(await page.until('seen.drawn', 20), { extensions: [true, true], sum: 3, error: 0 });
        const said = text => page.console.find(one => one.text.includes(text));
        for (const end = Date.now() + 5000; !said('thrown in the worker') && Date.now() < end;)
            await page.eval('new Promise(done => setTimeout(done, 20))');
        assert.match(said('the worker runs').worker, /worker\.js$/);
        assert.strictEqual(said('thrown in the worker').type, 'exception');
        assert.strictEqual(page.errors().length, 1);

        for (const code of ['KeyA', 'Digit7', 'ArrowLeft', 'Space', 'Enter', 'Escape', 'F2']) await page.key(code);
        await page.key('ShiftLeft', { down: true });
        await page.key('KeyQ', { hold: 120 });
        await page.key('ShiftLeft', { up: true });
        const typed = await page.eval('seen.keys');
        assert.deepStrictEqual(typed.filter(([type]) => type === 'keydown').map(key => key.slice(1, 5)), [
            ['a', 'KeyA', 65, false], ['7', 'Digit7', 55, false], ['ArrowLeft', 'ArrowLeft', 37, false],
            [' ', 'Space', 32, false], ['Enter', 'Enter', 13, false], ['Escape', 'Escape', 27, false],
            ['F2', 'F2', 113, false], ['Shift', 'ShiftLeft', 16, true], ['Q', 'KeyQ', 81, true]]);
        const at = (type, code) => typed.find(key => key[0] === type && key[2] === code)[5];
        assert(at('keyup', 'KeyQ') - at('keydown', 'KeyQ') >= 100);
        assert.strictEqual(typed.filter(([type]) => type === 'keyup').length, 9);

        await page.click('#press');
        assert.strictEqual(await page.eval('seen.clicks'), 1);
        await assert.rejects(page.click('#nothing'), /the page has no #nothing/);
        await assert.rejects(page.eval('nothing.there'), /ReferenceError: nothing is not defined/);
        await assert.rejects(page.eval('Promise.reject(new Error("refused"))'), /refused/);
        await assert.rejects(page.until('false', 0.1), /waited 0\.1 s for false/);

        await page.size(500, 350, 2);
        assert.deepStrictEqual(await page.eval('[innerWidth, innerHeight, devicePixelRatio]'), [500, 350, 2]);
        await page.emulate({ colorScheme: 'dark', touch: true });
        assert.strictEqual(await page.eval('getComputedStyle(document.body).backgroundColor'), 'rgb(0, 0, 0)');
        assert.strictEqual(await page.eval('navigator.maxTouchPoints'), 5);
        const picture = path.join(folder, 'picture.png');
        await page.screenshot(picture);
        const png = fs.readFileSync(picture);
        assert.deepStrictEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [1000, 700]);

        const { heap, processes, rss, pss } = await page.memory();
        assert(heap > 100e3 && heap < 100e6 && pss > 30e6 && pss <= rss);
        assert(processes.some(p => p.type === 'renderer') && processes.some(p => p.type === 'browser'));

        await page.until('navigator.serviceWorker.controller !== null', 10);
        server.forget();
        await page.offline(true);
        await assert.rejects(page.eval('fetch("some.wasm").then(answer => answer.status)'), /Failed to fetch/);
        await page.reload();
        assert.strictEqual((await page.until('seen.drawn', 20)).sum, 3);
        assert.strictEqual([...server.counts.values()].reduce((all, one) => all + one.asked, 0), 0);
        await page.offline(false);

        const fetched = 'fetch("some.wasm", { cache: "no-cache" }).then(async a => [a.headers.get("content-type"), ...new Uint8Array(await a.arrayBuffer())])';
        const whole = ['application/wasm', ...files['some.wasm']];
        assert.deepStrictEqual(await page.eval(fetched), whole);
        assert.deepStrictEqual(await page.eval(fetched), whole);
        assert.strictEqual(server.counts.get('/some.wasm').unchanged, 1);
        server.corrupt('/some.wasm', 4);
        assert.deepStrictEqual((await page.eval(fetched))[5], 0);
        server.restore();
        server.delay('/some.wasm', 300);
        assert(await page.eval(`(async () => { const from = performance.now(); await ${fetched}; return performance.now() - from; })()`) >= 290);
        server.act('/some.wasm', { cut: 3 });
        await assert.rejects(page.eval('fetch("some.wasm", { cache: "no-store" }).then(a => a.arrayBuffer())'));
        server.restore();
        assert.strictEqual(await page.eval('fetch("../../etc/passwd").then(a => a.status)'), 404);

        page.console.length = 0;
        await page.go(server.url + 'strict.html');
        await page.eval('new Promise(done => setTimeout(done, 100))');
        assert(page.errors().some(one => /Content Security Policy/.test(one.text)));
        console.log(`browser: all as expected; ${processes.length} processes, ${(pss / 1e6).toFixed(0)} MB`);
    } finally {
        await browser?.stop();
        await server?.stop();
        fs.rmSync(folder, { recursive: true, force: true });
    }
}

main().catch(error => {
    console.error(error.stack);
    process.exitCode = 1;
});
