// node tests/web/page_test.js PAGE PROGRAM PICTURES [PARTS]: a trainee's way in Debian's chromium, from the front page by keys to the
// recording, which the program replays; images beside the program's; what a page promises besides: offline, damaged files,
// no WebGL 2, small and large screens, memory that does not grow. PICTURES gets screenshots to be looked at. PARTS is a regular
// expression, by default of all names of parts. Code 1 where something is not as promised.
'use strict';
const { spawnSync } = require('child_process');
const fs = require('fs');
const os = require('os');
const path = require('path');
const { start } = require('./browser.js');
const { compare, images_of, read_png } = require('./images.js');
const { serve } = require('./server.js');

const [folder, program, pictures] = process.argv.slice(2, 5).map(given => path.resolve(given));
const wanted = new RegExp(process.argv[5] ?? '');
const sleep = ms => new Promise(resolve => setTimeout(resolve, ms));
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'page-'));
let failures = 0;

function expect(fits, what) {
    if (fits) return;
    ++failures;
    console.log(`page: ${what}`);
}

/// What the console has but what belongs to chromium alone.
function complaints(page) {
    return page.console.filter(({ text, level, type }) =>
        !/GPU stall|GL Driver|swiftshader|SwiftShader/.test(text) && (type !== 'rendering' || level === 'error'));
}

async function with_page(options, visit) {
    const server = await serve(folder), browser = await start(options);
    try {
        await visit(browser.page, server, browser);
    } finally {
        await browser.stop();
        await server.stop();
    }
}

const shown = id => `document.getElementById('${id}')?.offsetParent !== null`;

async function open(page, server, name, how = 'first') {
    await page.go(server.url + 'index.html');
    await page.until(`document.querySelector('[data-exercise=${name}]')`, 60);
    await page.eval(`document.querySelector('[data-exercise=${name}] .${how}') || document.getElementById('open-all').click()`);
    const began = Date.now();
    await page.eval(`document.querySelector('[data-exercise=${name}] .${how}').click()`);
    await page.until(`${shown('start')} && !document.getElementById('start').disabled`, 60);
    return Date.now() - began;
}

/// Brings the wire of 'straight' to its target as a trainee does, by keys; the recording's bytes.
async function whole_exercise(page, server) {
    const loaded = await open(page, server, 'straight');
    console.log(`page: the briefing of 'straight' is complete after ${loaded} ms`);
    await page.screenshot(path.join(pictures, 'briefing.png'));
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(3500);
    await page.key('Space', { down: true });
    await page.key('ArrowUp', { down: true });
    await sleep(2000);
    await page.screenshot(path.join(pictures, 'room.png'));
    await page.until(`document.body.dataset.screen === 'end'`, 60);
    await page.key('ArrowUp', { up: true });
    await page.key('Space', { up: true });
    await page.screenshot(path.join(pictures, 'end.png'));
    const title = await page.eval(`document.querySelector('#end h1').textContent`);
    expect(/^Target reached/.test(title), `expected 'Target reached' after the wire was pushed, found '${title}'`);
    return saved(page, 'download');
}

/// What a button gives the browser to be saved.
async function saved(page, id) {
    return Buffer.from(await page.eval(`(async () => {
        const blobs = [], made = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
        URL.createObjectURL = blob => { blobs.push(blob); return made(blob); };
        HTMLAnchorElement.prototype.click = () => {};
        document.getElementById('${id}').click();
        for (let k = 0; k < 50 && blobs.length === 0; ++k) await new Promise(resolve => setTimeout(resolve, 100));
        URL.createObjectURL = made;
        HTMLAnchorElement.prototype.click = click;
        let text = '';
        for (const byte of new Uint8Array(await blobs[0].arrayBuffer())) text += String.fromCharCode(byte);
        return btoa(text);
    })()`), 'base64');
}

/// The debriefing of the attempt that has just ended, and the teacher's table of what the browser keeps.
async function papers(page) {
    await page.eval(`document.getElementById('debrief').click()`);
    await page.until(`document.querySelector('#paper-frame iframe')`, 60);
    await sleep(1000);
    await page.screenshot(path.join(pictures, 'debriefing.png'));
    const debriefing = (await saved(page, 'paper-save')).toString();
    expect(/<title>Debriefing/.test(debriefing) && /data:image\/png/.test(debriefing) && /straight-001/.test(debriefing),
           `expected a debriefing of straight-001 with pictures, found ${debriefing.slice(0, 200)}`);
    await page.eval(`document.getElementById('paper-back').click()`);
    await page.eval(`document.getElementById('to-teacher').click()`);
    await page.eval(`document.getElementById('of-here').click()`);
    await page.until(`document.querySelector('#course iframe')`, 60);
    await sleep(1000);
    await page.screenshot(path.join(pictures, 'course.png'));
    const course = (await saved(page, 'course-save')).toString();
    expect(/Straight/.test(course) && !/does not count/.test(course),
           `expected a table with an attempt at 'straight' that counts, found ${course.slice(0, 200)}`);
    await page.click('#course-watch summary');
    await page.screenshot(path.join(pictures, 'course-watch.png'));
    await page.click('#course-watch button');
    await page.until(`document.body.dataset.screen === 'room'`, 60);
}

/// Largest differences that the page's images may have from the program's [grey levels of 255]: those of golden frames,
/// where the engine itself draws; more where WebGL does, which snaps corners to 1/16 of a pixel here, not to 1/256.
const { limits } = JSON.parse(fs.readFileSync(path.join(__dirname, '../frames/head/limits.json')));
const limits_of_webgl = { mean_difference: 0.09, largest_difference: 40, tile_difference: 0.5 };
const rasterisers = { processor: [true, limits], webgl: [false, limits_of_webgl] };

/// Put before worker.js: browsers without WebGL 2, and with one that cannot add floats.
const lacks = { webgl: 'OffscreenCanvas.prototype.getContext = () => null;\n', floats: 'WebGL2RenderingContext.prototype.getExtension = () => null;\n' };
function in_worker(server, before) {
    server.act('/worker.js', { change: bytes => Buffer.concat([Buffer.from(before), bytes]) });
}

async function images(page, exercise, rasteriser) {
    const [drawn_by_engine, allowed] = rasterisers[rasteriser];
    const out = path.join(work, 'frames-' + exercise);
    const ran = spawnSync(program, ['run', exercise, '--commands', 'solution', '--out', out, '--cache', path.join(work, 'cache')],
                          { encoding: 'utf8' });
    if (ran.status !== 0) throw new Error(`${exercise}: ${ran.stderr}`);
    const all = fs.readdirSync(path.join(out, 'frames')).map(file => Number(file.match(/\d+/)[0]));
    const { software, images: found } = await images_of(page, exercise, all.filter((frame, k) => k % 10 === 3));
    expect(software === drawn_by_engine, `${exercise}: expected images by ${rasteriser}, found software = ${software}`);
    const worst = {};
    for (const [frame, image] of Object.entries(found)) {
        const file = path.join(out, 'frames', `frame_${frame.padStart(6, '0')}.png`);
        for (const [name, value] of Object.entries(compare(read_png(file), image)))
            worst[name] = Math.max(worst[name] ?? 0, value);
    }
    expect(Object.keys(found).length >= 5, `${exercise}: expected at least 5 images, found ${Object.keys(found).length}`);
    for (const name of Object.keys(worst))
        expect(worst[name] <= allowed[name], `${exercise}, ${rasteriser}: ${name}: expected at most ${allowed[name]}, found ${worst[name]}`);
    console.log(`page: ${exercise}: ${Object.keys(found).length} images by ${rasteriser} beside the program's: ` +
                Object.entries(worst).map(([name, value]) => `${name} ${value.toFixed(3)}`).join(', '));
}

/// Each exercise is opened and seen for a moment, twice, in one engine; memory [MB] after both, of the page's process and of all of the browser's.
async function memory_of_all(page, server) {
    await page.go(server.url + 'files.json');  // no engine but this one
    await page.eval(`new Promise(resolve => {
        window.engine = new Worker('worker.js');
        window.engine.onmessage = ({data}) => {
            if (data.is === 'ready') resolve(window.names = data.exercises.map(({name}) => name));
        };
    })`);
    const used = [], tab = [];
    for (let round = 0; round < 2; ++round) {
        for (const name of await page.eval('window.names'))
            await page.eval(`new Promise((resolve, reject) => {
                let images = 0;
                engine.onmessage = ({data}) => {
                    if (data.is === 'briefing') {
                        engine.postMessage({do: 'start'});
                        engine.postMessage({do: 'input', held: ['fluoroscopy', 'advance']});
                    }
                    if (data.is === 'failed') reject(new Error('${name}: ' + data.error));
                    if (data.is === 'view' && data.image && ++images === 5) {
                        engine.postMessage({do: 'close'});
                        resolve();
                    }
                };
                engine.postMessage({do: 'open', exercise: '${name}', learner: ''});
            })`);
        await sleep(3000);
        const { pss, processes } = await page.memory();
        used.push(pss / 1e6);
        tab.push(Math.max(...processes.map(one => one.type === 'renderer' ? one.pss : 0)) / 1e6);
    }
    const shown = numbers => numbers.map(number => number.toFixed(0)).join(', ');
    console.log(`page: memory after all exercises and after all once more: the page's process ${shown(tab)} MB, all of chromium's ` +
                `${shown(used)} MB`);
    expect(Math.max(...tab) < 600, `expected a page of at most 600 MB, found ${shown(tab)} MB`);
    expect(used[1] < 1.1 * used[0] + 50, `expected memory that does not grow, found ${used.join(' and ')} MB`);
}

/// A run that is gone when it is asked for: an answer, and the exercise goes on.
async function gone_run(page, server) {
    await page.go(server.url + 'index.html');
    const found = await page.eval(`new Promise((resolve, reject) => {
        const worker = new Worker('worker.js');
        let answers = 0, after = 0;
        worker.onmessage = ({data}) => {
            if (data.is === 'ready') worker.postMessage({do: 'open', exercise: 'straight', learner: ''});
            if (data.is === 'briefing') {
                worker.postMessage({do: 'start'});
                worker.postMessage({do: 'input', held: ['fluoroscopy']});
                worker.postMessage({do: 'look', run: 9, image: 0});
                worker.postMessage({do: 'measure', run: 9, ruler: [0, 0, 9, 9]});
            }
            if (data.is === 'failed') reject(new Error(data.error));
            if (['picture', 'measured'].includes(data.is) && /number of a run|no run/.test(data.error)) ++answers;
            if (data.is === 'view' && data.image && answers === 2 && ++after === 5) {
                worker.terminate();
                resolve(true);
            }
        };
    })`);
    expect(found, 'expected an exercise that goes on after a run was asked for that is gone');
}

/// When the first image of a patient is there, from an empty browser and from one that knows the page [ms].
async function first_image(page, server) {
    const once = async () => {
        await page.go(server.url + 'index.html');
        return page.eval(`new Promise((resolve, reject) => {
            const begun = performance.now(), worker = new Worker('worker.js');
            worker.onmessage = ({data}) => {
                if (data.is === 'ready') worker.postMessage({do: 'open', exercise: 'renal', learner: ''});
                if (data.is === 'briefing') {
                    worker.postMessage({do: 'start'});
                    worker.postMessage({do: 'input', held: ['fluoroscopy']});
                }
                if (data.is === 'failed') reject(new Error(data.error));
                if (data.is === 'view' && data.image) {
                    setTimeout(() => worker.terminate(), 5000);  // it keeps the patient meanwhile
                    resolve(performance.now() - begun);
                }
            };
        })`);
    };
    const cold = await once();
    await sleep(6000);
    console.log(`page: the first image of 'renal' after ${cold.toFixed(0)} ms, once visited after ${(await once()).toFixed(0)} ms`);
}

/// Holds keys for a while [ms].
async function hold(page, ms, ...codes) {
    for (const code of codes) await page.key(code, { down: true });
    await sleep(ms);
    for (const code of codes) await page.key(code, { up: true });
}

/// From the middle of an element to the right and down, in parts of its size, with the left button.
async function drag(page, selector, [x0, y0], [x1, y1]) {
    const box = await page.eval(`(({left, top, width, height}) => ({left, top, width, height}))(document.querySelector('${selector}').getBoundingClientRect())`);
    const mouse = (type, x, y, buttons) => page.send('Input.dispatchMouseEvent',
        { type, x: box.left + x * box.width, y: box.top + y * box.height, button: type === 'mouseMoved' ? 'none' : 'left', buttons, clickCount: 1 });
    await mouse('mouseMoved', x0, y0, 0);
    await mouse('mousePressed', x0, y0, 1);
    for (let k = 1; k <= 4; ++k) await mouse('mouseMoved', x0 + (x1 - x0) * k / 4, y0 + (y1 - y0) * k / 4, 1);
    await mouse('mouseReleased', x1, y1, 0);
}

/// Presses Tab until an element has the focus: whether it can be reached by keys alone.
async function tab_to(page, selector, most = 60) {
    for (let k = 0; k < most; ++k) {
        if (await page.eval(`document.activeElement?.matches('${selector}') ?? false`)) return true;
        await page.key('Tab', { hold: 5 });
    }
    return false;
}

const words_of = id => `document.getElementById('${id}').textContent`;
const number_in = text => Number(/[\d.]+/.exec(text)?.[0]);

/// What the map of the briefing has: pixels of the way's colour and of the target's.
async function map_of_briefing(page, server) {
    await open(page, server, 'renal');
    const found = await page.eval(`(() => {
        const canvas = document.getElementById('briefing-map'), {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        const count = (r, g, b) => { let n = 0; for (let k = 0; k < data.length; k += 4) n += data[k] === r && data[k + 1] === g && data[k + 2] === b; return n; };
        return {way: count(246, 204, 62), target: count(92, 184, 120), vessels: count(58, 68, 76), label: canvas.getAttribute('aria-label'), seen: canvas.offsetParent !== null};
    })()`);
    expect(found.seen && found.way > 200 && found.target > 50 && found.vessels > 2000 && /Map/.test(found.label),
           `expected a map with vessels, a way and a target, found ${JSON.stringify(found)}`);
}

/// An attempt at 'straight' in which the wire is pushed without beam at first; its end page.
async function blind_attempt(page, server) {
    await open(page, server, 'straight');
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(3500);
    await hold(page, 700, 'Space');
    await hold(page, 2500, 'ArrowUp');
    await page.key('Space', { down: true });
    await page.key('ArrowUp', { down: true });
    await page.until(`document.body.dataset.screen === 'end'`, 60);
    await page.key('ArrowUp', { up: true });
    await page.key('Space', { up: true });
}

/// The times of the end page, by keys: the image of the moment; its ruler; then recordings, one after the other.
async function review(page, server) {
    await blind_attempt(page, server);
    await page.until(`document.querySelector('#events .time')`, 10);
    expect(/time opens the images/.test(await page.eval(words_of('times-open'))), 'expected a sentence about what a time opens');
    expect(await tab_to(page, '#events .time'), 'expected a time of an event that Tab reaches');
    await page.screenshot(path.join(pictures, 'end-times.png'));
    await page.key('Enter');
    await page.until(`document.getElementById('review').open && /image \\d+ of/.test(${words_of('review-words')})`, 10);
    const at = await page.eval(`[document.getElementById('review-image').value, document.getElementById('review-play').textContent]`);
    expect(at[1] === 'Play' && Number(at[0]) >= 1, `expected an image that stands, found ${at}`);

    // At its rate: where the loop is after a time that the page's own clock gives.
    await page.eval(`document.getElementById('review-run').value = [...document.getElementById('review-run').options].at(-1).value`);
    const run = await page.eval(`(() => { const select = document.getElementById('review-run'); select.dispatchEvent(new Event('change')); return select.selectedOptions[0].textContent; })()`);
    const images = Number(/(\d+) images/.exec(run)[1]), rate = number_in(await page.eval(words_of('review-rate')));
    expect(rate > 0 && images > 10, `expected a rate and a run of some images, found ${rate}, ${run}`);
    await page.click('#review-play');
    const seen = await page.eval(`new Promise(resolve => {
        const input = document.getElementById('review-image'), found = [], begun = performance.now();
        const look = () => {
            found.push([performance.now() - begun, Number(input.value)]);
            performance.now() - begun < 2500 ? requestAnimationFrame(look) : resolve(found);
        };
        look();
    })`);
    const first = seen[0], last = seen.at(-1), due = rate * (last[0] - first[0]) / 1000;
    const turned = ((last[1] - first[1]) - due) / images, off = Math.abs(turned - Math.round(turned)) * images;
    console.log(`page: a loop of ${images} images at ${rate}/s is ${off.toFixed(1)} images off after ${last[0].toFixed(0)} ms`);
    expect(off <= 2, `expected a loop of ${rate} images a second, found it ${off} images off after ${last[0]} ms`);
    await page.click('#review-play');

    // The ruler: switched on by keys, laid by the mouse, moved by keys.
    expect(await tab_to(page, '#review-rules'), 'expected a ruler that Tab reaches');
    await page.key('Space');
    await page.until(`/mm/.test(${words_of('ruler-length')})`, 10);
    await drag(page, '#review-picture', [0.25, 0.5], [0.75, 0.5]);
    await sleep(500);
    const text = await page.eval(`[${words_of('ruler-length')}, ${words_of('ruler-scale')}, document.getElementById('review-picture').width]`);
    const [, mm, pixels] = /([\d.]+) mm\s+\(([\d.]+) pixels\)/.exec(text[0]) ?? [], scale = number_in(text[1]);
    expect(/isocentre/.test(text[1]) && Math.abs(pixels - text[2] / 2) < 2 && Math.abs(mm - pixels * scale) < 0.05 + 0.06 * scale,
           `expected half an image, and its millimetres at the isocentre, found ${text.join(', ')}`);
    const line = await page.eval(`(({width, height}) => ({width, height}))(document.querySelector('#ruler line').getBoundingClientRect())`);
    const wide = await page.eval(`document.getElementById('review-picture').getBoundingClientRect().width`);
    expect(Math.abs(line.width - wide / 2) < 4, `expected a line half as long as the image, found ${JSON.stringify(line)}`);
    expect(await tab_to(page, '#review-stage'), 'expected an image that Tab reaches');
    for (let k = 0; k < 5; ++k) await page.key('ArrowRight', { hold: 5 });
    await sleep(500);
    const longer = Number(/\(([\d.]+) pixels/.exec(await page.eval(words_of('ruler-length')))[1]);
    expect(Math.abs(longer - pixels - 5) < 0.2, `expected a ruler that five arrows make 5 pixels longer than ${pixels}, found ${longer}`);
    // Across the wire, where it is darkest, upward or sideways.
    const dark = await page.eval(`(() => {
        const canvas = document.getElementById('review-picture'), {width, height} = canvas, {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
        const contrast = (at, step, count) => { let least = 255, where = 0, sum = 0;
            for (let k = 20; k < count - 20; ++k) { const grey = data[4 * (at + k * step)]; sum += grey; if (grey < least) { least = grey; where = k; } }
            return [sum / (count - 40) - least, where]; };
        let best = [0];
        for (let line = 40; line < height - 40; line += 8) {
            const [down, row] = contrast(line, width, height), [along, column] = contrast(line * width, 1, width);
            if (down > best[0]) best = [down, line, row, 0, 12];
            if (along > best[0]) best = [along, column, line, 12, 0];
        }
        return {x: best[1] / width, y: best[2] / height, dx: best[3] / width, dy: best[4] / height, depth: best[0]};
    })()`);
    await drag(page, '#review-picture', [dark.x - dark.dx, dark.y - dark.dy], [dark.x + dark.dx, dark.y + dark.dy]);
    await page.click('#ruler-wire');
    await page.until(`/calibrated on the wire/.test(${words_of('ruler-scale')})`, 10);
    await page.screenshot(path.join(pictures, 'review.png'));
    const calibrated = number_in(await page.eval(words_of('ruler-scale')));
    console.log(`page: ruler: ${scale} mm a pixel at the isocentre, ${calibrated} by the wire`);
    expect(calibrated > 0.4 * scale && calibrated < 2.5 * scale, `expected a scale by the wire like ${scale} mm a pixel, found ${calibrated}`);
    await page.click('#ruler-isocentre');
    await page.until(`/isocentre/.test(${words_of('ruler-scale')})`, 10);
    await page.key('Escape');
    expect(complaints(page).length === 0, `expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);

    // A second recording, and both are watched, faster than they were made.
    await page.click('#again');
    await page.until(`${shown('start')} && !document.getElementById('start').disabled`, 60);
    await page.key('Enter');
    await sleep(4500);
    await page.key('End');
    await page.until(`document.getElementById('asking').open`, 10);
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'end'`, 20);
    await page.click('#to-recordings');
    await page.until(`document.querySelectorAll('#recordings-table tbody tr').length === 2`, 10);
    await page.click('#recordings-table tbody tr button');
    await page.until(`document.body.dataset.screen === 'room'`, 60);
    const faster = `(() => { const speed = document.getElementById('speed'); speed.value = 8; speed.dispatchEvent(new Event('change')); })()`;
    await page.eval(faster);
    await page.until(`document.body.dataset.screen === 'end' && ${shown('next-recording')}`, 60);
    expect(/^Next recording \(2 of 2\)$/.test(await page.eval(words_of('next-recording'))), 'expected a button for the next recording');
    expect(/to the bit/.test(await page.eval(words_of('end-notes'))), 'expected a recording that led to the same states');
    await page.screenshot(path.join(pictures, 'end-recording.png'));
    expect(await tab_to(page, '#next-recording'), 'expected a next recording that Tab reaches');
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 60);
    await page.eval(faster);
    await page.until(`document.body.dataset.screen === 'end' && !${shown('next-recording')}`, 120);
    expect(await page.eval(`document.querySelectorAll('#events .time').length > 0`), 'expected times of events in a recording too');
    expect(complaints(page).length === 0, `expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);
}

/// Whether the view into the patient has been drawn, and what of it is bright: a key turns it, so that it is drawn anew.
const inside_pixels = `new Promise(resolve => {
    const canvas = document.getElementById('inside-view'), gl = canvas.getContext('webgl2');
    canvas.dispatchEvent(new KeyboardEvent('keydown', {code: 'ArrowLeft', bubbles: true, cancelable: true}));
    requestAnimationFrame(() => {
        const {width, height} = canvas, pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        let lit = 0, sum = 0;
        for (let k = 0; k < pixels.length; k += 4) { lit += pixels[k] > 40; sum = (sum * 31 + pixels[k]) | 0; }
        resolve({lit: lit / (width * height), sum, width, height});
    });
})`;

/// The view into the patient, by its key, while the exercise goes on; the score says that it was open.
async function inside(page, server) {
    await open(page, server, 'renal');
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(3500);
    await page.key('Space', { down: true });
    await page.key('F12');
    await page.until(`${shown('inside')} && /wall force/.test(${words_of('inside-legend')})`, 20);
    await page.key('ArrowUp', { down: true });
    await sleep(2500);
    await page.key('ArrowUp', { up: true });
    await page.screenshot(path.join(pictures, 'inside.png'));
    const before = await page.eval(inside_pixels);
    expect(before.lit > 0.02, `expected vessels in the view into the patient, found ${JSON.stringify(before)}`);
    await page.eval(`document.getElementById('inside-view').focus()`);
    for (let k = 0; k < 5; ++k) await page.key('ArrowRight', { hold: 5 });
    const after = await page.eval(inside_pixels);
    expect(after.sum !== before.sum, 'expected a view that arrow keys turn');
    await page.key('Escape');
    await page.key('F12');
    await page.until(`!${shown('inside')}`, 10);
    await page.key('Space', { up: true });
    await page.key('End');
    await page.until(`document.getElementById('asking').open`, 10);
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'end'`, 20);
    const told = await page.eval(words_of('events'));
    expect(/helped by the teacher.*target shown/.test(told), `expected an end page that says the target was shown, found ${told}`);
    expect(complaints(page).length === 0, `expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);
}

/// Another patient of an exercise, where the page has some: `app/web.sh --patients`.
async function patients(page, server) {
    const { exercises } = JSON.parse(fs.readFileSync(path.join(folder, 'exercises.json')));
    const [name] = Object.entries(exercises).find(([, its]) => '2' in its) ?? [];
    await open(page, server, name ?? 'renal');
    const offered = await page.eval(`document.querySelectorAll('#patients button').length`);
    expect(name ? offered === Object.keys(exercises[name]).length : offered === 0, `expected the patients that are there, found ${offered}`);
    if (!name) return console.log('page: no other patients are in this page: not tried');
    const map = `document.getElementById('briefing-map').toDataURL()`, first = await page.eval(map);
    expect(await tab_to(page, '#patients button:nth-of-type(2)'), 'expected other patients that Tab reaches');
    await page.key('Enter');
    await page.until(`document.querySelector('#patients button:nth-of-type(2)').ariaPressed === 'true' && !document.getElementById('start').disabled`, 60);
    expect(await page.eval(map) !== first, 'expected another map for another patient');
    await page.screenshot(path.join(pictures, 'patient-2.png'));
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(3500);
    await hold(page, 1500, 'Space', 'ArrowUp');
    await page.key('End');
    await page.until(`document.getElementById('asking').open`, 10);
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'end'`, 20);
    expect(/patient 2/.test(await page.eval(words_of('end-about'))), 'expected an end page that names the patient');
    const recording = path.join(work, `${name}-patient-2.gw`);
    fs.writeFileSync(recording, await saved(page, 'download'));
    const replayed = spawnSync(program, ['replay', recording, '--cache', path.join(work, 'cache')], { encoding: 'utf8' });
    expect(replayed.status === 0 && /all equal/.test(replayed.stdout), `patient 2: ${replayed.stdout}${replayed.stderr}`);
    await page.click('#watch');
    await page.until(`document.body.dataset.screen === 'room'`, 60);
    await page.until(`document.body.dataset.screen === 'end'`, 60);
    expect(/to the bit/.test(await page.eval(words_of('end-notes'))), 'expected an attempt at patient 2 that is watched with the same states');
}

/// The folder as it is, without a server.
async function without_server(page) {
    await page.go(`file://${folder}/index.html`);
    await page.until(`document.querySelector('[data-exercise=straight]')`, 60);
    await page.click('[data-exercise=straight] .first');
    await page.until(`${shown('start')} && !document.getElementById('start').disabled`, 60);
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(3500);
    await page.key('Space', { down: true });
    await page.key('ArrowUp', { down: true });
    await page.until(`document.body.dataset.screen === 'end'`, 60);
    await page.key('ArrowUp', { up: true });
    await page.key('Space', { up: true });
    expect(/^Target reached/.test(await page.eval(words_of('end-title'))), 'a folder: expected an exercise that is reached');
    await page.click('#debrief');
    await page.until(`document.querySelector('#paper-frame iframe')`, 60);
    await sleep(1500);
    await page.screenshot(path.join(pictures, 'folder-debriefing.png'));
    await page.reload();
    await page.until(`document.querySelector('[data-exercise=renal]')`, 60);
    await page.click('#to-recordings');
    await page.until(`document.querySelectorAll('#recordings-table tbody tr').length === 1`, 10);
    const begun = Date.now();
    await page.click('#home');
    await page.click('[data-exercise=renal] .free');
    await page.until(`${shown('start')} && !document.getElementById('start').disabled`, 60);
    console.log(`page: a folder: the briefing of 'renal' is complete after ${Date.now() - begun} ms`);
    await page.screenshot(path.join(pictures, 'folder.png'));
    expect(complaints(page).length === 0, `a folder: expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);
}

/// When the front page shows what it is: the picture, and the demonstration that moves [ms].
async function demonstration(page, server) {
    await page.send('Page.addScriptToEvaluateOnNewDocument', { source: `
        window.marks = {};
        const look = () => {
            const still = document.querySelector('#demo-frame img');
            if (still?.complete && still.naturalWidth) marks.still ??= performance.now();
            if (document.getElementById('demo-box')?.classList.contains('plays')) marks.moves ??= performance.now();
            if (!marks.moves) requestAnimationFrame(look);
        };
        look();` });
    await page.go(server.url + 'index.html');
    const { still, moves } = await page.until(`marks.moves && marks`, 60);
    console.log(`page: the front page shows a picture after ${still.toFixed(0)} ms and the demonstration after ${moves.toFixed(0)} ms`);
    expect(still < 3000, `expected a picture within 3 s, found it after ${still} ms`);
    await sleep(2000);
    expect(/four times/.test(await page.eval(words_of('demo-words'))) && await page.eval(`document.getElementById('demo-box').classList.contains('plays')`),
           'expected a demonstration that goes on');
}

/// What is new on small, usual and large screens, to be looked at; nothing is wider than the screen.
async function sizes(page, server, name) {
    const picture = what => page.screenshot(path.join(pictures, `${what}-${name}.png`));
    const fits = async what => {
        const wide = await page.eval('document.documentElement.scrollWidth - innerWidth');
        expect(wide <= 0, `${what}, ${name}: expected a page as wide as the screen, found one that is ${wide} pixels wider`);
    };
    await open(page, server, 'renal', 'free');
    await picture('briefing');
    await fits('briefing');
    await page.emulate({ colorScheme: 'light' });
    await picture('briefing-light');
    await page.emulate({ colorScheme: 'dark' });
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await sleep(500);
    await page.key('F12');
    await hold(page, 3500, 'Space', 'ArrowUp');
    await picture('inside');
    await page.key('F12');
    await page.key('KeyV');
    await page.until(`document.getElementById('review').open`, 10);
    await page.eval(`document.getElementById('review-rules').click()`);
    await sleep(700);
    await picture('review');
    expect(await page.eval(`(({left, right}) => left >= 0 && right <= innerWidth)(document.getElementById('review-stage').getBoundingClientRect())`),
           `review, ${name}: expected an image within the screen`);
}

/// What a screen reader has of each screen, by chromium's tree of accessibility: everything that can be operated has a
/// name, and Tab reaches all of it.
async function reader(page, server) {
    const operable = /^(button|link|textbox|slider|combobox|checkbox|switch|spinbutton|menuitem|radio|tab)$/i;
    const heard = async where => {
        const { nodes } = await page.send('Accessibility.getFullAXTree');
        const shown = nodes.filter(({ ignored, role }) => !ignored && operable.test(role?.value ?? ''));
        const nameless = shown.filter(({ name }) => !name?.value?.trim());
        expect(shown.length > 0 && nameless.length === 0,
               `${where}: expected controls that all have names, found ${shown.length}, ${nameless.length} of them without: ` +
               nameless.map(({ role }) => role.value).join(', '));
        return shown.length;
    };
    const reached = async where => {
        const missed = await page.eval(`(() => {
            const scope = [...document.querySelectorAll('dialog[open]')].pop() ?? document;
            return [...scope.querySelectorAll('button, a[href], input, select, textarea, summary')]
                .filter(e => e.offsetParent !== null && !e.disabled && getComputedStyle(e).visibility === 'visible' && e.tabIndex < 0)
                .map(e => e.id || e.textContent);
        })()`);
        expect(missed.length === 0, `${where}: expected controls that Tab reaches, found others: ${missed.join(', ')}`);
    };
    const counts = [];
    const look = async where => {
        counts.push(`${where} ${await heard(where)}`);
        await reached(where);
    };
    await page.go(server.url + 'index.html');
    await page.until(`document.querySelector('[data-exercise=renal]')`, 60);
    await look('front page');
    await page.eval(`document.querySelector('[data-exercise=renal] .free').click()`);
    await page.until(`document.getElementById('start').offsetParent && !document.getElementById('start').disabled`, 60);
    await look('briefing');
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    await hold(page, 2500, 'Space', 'ArrowUp');
    await look('room');
    await page.key('KeyV');
    await page.until(`document.getElementById('review').open`, 10);
    await look('runs');
    await page.key('Escape');
    await page.until(`!document.getElementById('review').open`, 10);
    await page.key('End');
    await page.until(`document.getElementById('asking').open`, 10);
    await page.key('Enter');
    await page.until(`document.body.dataset.screen === 'end'`, 20);
    await look('end page');
    console.log(`page: controls that a screen reader names: ${counts.join(', ')}`);
}

/// Two thumbs on a telephone, one on a pedal and one on the pad, and a gamepad: the wire goes in, and the beam is on.
async function thumbs_and_gamepad(page, server) {
    await page.emulate({ touch: true });
    await open(page, server, 'straight', 'free');
    await page.click('#start');
    await page.until(`document.body.dataset.screen === 'room'`, 10);
    const readout = async () => {
        const [inserted, beam] = await page.eval(`['Inserted', 'Fluoro time'].map(name => [...document.querySelectorAll('dl *')]
            .find(e => e.children.length === 0 && e.textContent === name)?.nextElementSibling?.textContent ?? '')`);
        return { inserted: parseFloat(inserted), beam: beam.split(':').reduce((all, part) => 60 * all + Number(part), 0) };
    };
    const middle = selector => page.eval(`(({left, top, width, height}) => ({x: left + width / 2, y: top + height / 2}))(
        document.querySelector('${selector}').getBoundingClientRect())`);
    const [pedal, pad] = [await middle('#pedals [data-action=fluoroscopy]'), await middle('#pad-area')];
    const touch = (type, ...points) => page.send('Input.dispatchTouchEvent', { type, touchPoints: points });
    let before = await readout();
    for (let k = 0; k < 50 && isNaN(before.inserted); ++k) {
        await sleep(100);
        before = await readout();
    }
    await touch('touchStart', { ...pedal, id: 0 });
    await touch('touchStart', { ...pedal, id: 0 }, { ...pad, id: 1 });
    for (let k = 1; k <= 5; ++k) await touch('touchMove', { ...pedal, id: 0 }, { x: pad.x, y: pad.y - 10 * k, id: 1 });
    await sleep(2500);
    await page.screenshot(path.join(pictures, 'thumbs.png'));
    await touch('touchEnd');
    await sleep(500);
    const thumbs = await readout();
    expect(thumbs.inserted > before.inserted + 3 && thumbs.beam > before.beam,
           `thumbs: expected a wire pushed from ${before.inserted} mm by more than 3 mm under the beam, found ${JSON.stringify(thumbs)}`);
    await sleep(1000);
    const rested = await readout();
    expect(rested.inserted === thumbs.inserted && rested.beam === thumbs.beam,
           `thumbs: expected hands and pedals that rest once let go at ${JSON.stringify(thumbs)}, found ${JSON.stringify(rested)}`);
    const gamepad = (axes, ...pressed) => page.eval(`(navigator.getGamepads = () => [{connected: true, mapping: 'standard',
        axes: ${JSON.stringify(axes)}, buttons: Array.from({length: 17}, (none, k) => ({pressed: ${JSON.stringify(pressed)}.includes(k)}))}], 0)`);
    await gamepad([0, 0, 0, -1], 0);
    await sleep(1500);
    await gamepad([0, 0, 0, 0]);
    await sleep(500);
    const sticks = await readout();
    expect(sticks.inserted > rested.inserted + 10 && sticks.beam > rested.beam,
           `gamepad: expected a wire pushed from ${rested.inserted} mm by more than 10 mm under the beam, found ${JSON.stringify(sticks)}`);
    await gamepad([0, 0, 0, 1]);
    await sleep(1000);
    await gamepad([0, 0, 0, 0]);
    await sleep(500);
    expect((await readout()).inserted < sticks.inserted - 5, `gamepad: expected a wire pulled from ${sticks.inserted} mm`);
    console.log(`page: inserted ${before.inserted} mm, by thumbs ${thumbs.inserted} mm, by sticks ${sticks.inserted} mm`);
}

/// In a page: where a canvas has ink of a colour, [column, mean row, count] of each column that has any, in CSS pixels.
const inked = `(canvas, colour) => {
    const [r, g, b] = [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16)), scale = devicePixelRatio, found = [];
    const {width, height} = canvas, {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
    for (let x = 0; x < width; ++x) {
        let rows = 0, count = 0;
        for (let y = 0; y < height; ++y) {
            const at = 4 * (y * width + x), [red, green, blue, alpha] = data.slice(at, at + 4);
            if (alpha > 60 && Math.abs(red - r) + Math.abs(green - g) + Math.abs(blue - b) < 40) rows += y + 0.5, ++count;
        }
        if (count) found.push([(x + 0.5) / scale, rows / count / scale, count]);
    }
    return found;
}`;

/// The column of readouts as it is in app/web/page, alone, with readouts that are made up: pixels of the curves against the values
/// that they show, and the bar of a balloon's pressure.
async function curves_and_bar(page) {
    const server = await serve(path.join(__dirname, '../../app/web/page'));
    try {
        await page.go(server.url + 'room.css');
        await page.eval(`(async () => {
            const style = Object.assign(document.createElement('link'), {rel: 'stylesheet', href: '/room.css'});
            const styled = new Promise((resolve, reject) => Object.assign(style, {onload: resolve, onerror: reject}));
            document.head.append(style);
            await styled;
            const {Panel, ink} = await import('/panel.js');
            const column = Object.assign(document.createElement('div'), {style: 'width: 220px'});
            document.body.replaceChildren(column);
            window.ink = ink;
            window.panel = new Panel(column, () => {});
            window.inked = ${inked};
            window.shows = (curves, balloon) => panel.draw({
                groups: [{title: 'Pressure', rows: [['Now', '90 mmHg']]}], devices: [], force: {limit: 1, history: []}, curves,
                ...(balloon && {balloon: {title: 'Balloon', device: 'of 8 mm', rows: [['Balloon', '6 atm']], ...balloon}})}, {});
            window.drawn = (colour) => inked(panel.curves, colour);
        })()`);
        const drawn = async curves => page.eval(`(() => {
            shows(${JSON.stringify(curves)});
            return {width: panel.curves.clientWidth, height: panel.curves.clientHeight, ecg: drawn(ink.good), pressure: drawn(ink.alarm)};
        })()`);
        const share = 0.3;  // of the height, that the electrocardiogram has
        /// Of a canvas' part the row at which a value is drawn, and whether all columns lie within a pixel and a half of theirs.
        const row = (top, height, part) => top + height - 3 - Math.min(1, Math.max(0, part)) * (height - 6);
        const follows = (columns, width, expected) => columns.length > 0.9 * (width - 4) &&
            columns.every(([x, y]) => Math.abs(y - expected((x - 2) / (width - 4))) < 1.5);

        // A slope from end to end of its scale, and a line at a quarter of the other's.
        const count = 81, slope = Array.from({length: count}, (_, k) => 40 + 120 * k / (count - 1));
        const still = Array(count).fill(-0.25);
        const first = await drawn({ecg: {values: still, low: -0.5, high: 0.5}, pressure: {values: slope, low: 40, high: 160}});
        const split = share * first.height;
        expect(first.width > 100 && first.height > 50, `expected room for curves, found ${first.width} x ${first.height}`);
        expect(follows(first.pressure, first.width, t => row(split, first.height - split, t)),
               `the curve of pressure: expected a slope, found ${JSON.stringify(first.pressure.filter((_, k) => k % 20 === 0))}`);
        expect(follows(first.ecg, first.width, () => row(0, split, 0.25)),
               `the electrocardiogram: expected a line at a quarter, found ${JSON.stringify(first.ecg.filter((_, k) => k % 20 === 0))}`);

        // Missing values leave a gap; beyond the scale it stays at its ends.
        const gap = slope.map((_, k) => k > 30 && k < 50 ? null : k <= 30 ? 500 : -500);
        const second = await drawn({ecg: {values: still.map((_, k) => k === 40 ? 0.5 : -0.5), low: -0.5, high: 0.5}, pressure: {values: gap, low: 0, high: 160}});
        const at = (columns, t) => columns.filter(([x]) => Math.abs((x - 2) / (second.width - 4) - t) < 0.02).map(([, y]) => y);
        const near = (rows, wanted) => rows.length > 0 && rows.every(y => Math.abs(y - wanted) < 1.5);
        expect(at(second.pressure, 0.5).length === 0, `the curve of pressure: expected a gap, found ink at ${at(second.pressure, 0.5)}`);
        expect(near(at(second.pressure, 0.2), row(split, second.height - split, 1)) && near(at(second.pressure, 0.8), row(split, second.height - split, 0)),
               `the curve of pressure: expected the ends of its scale, found ${at(second.pressure, 0.2)} and ${at(second.pressure, 0.8)}`);
        expect(near(at(second.ecg, 0.2), row(0, split, 0)) && Math.min(...at(second.ecg, 0.5)) < 0.7 * split,
               `the electrocardiogram: expected one beat, found ${at(second.ecg, 0.2)} and ${at(second.ecg, 0.5)}`);
        expect((await drawn({ecg: {values: [], low: 0, high: 1}, pressure: {values: [], low: 0, high: 1}})).pressure.length === 0,
               'the curves: expected nothing of the readout before');

        // The bar: its length, full at the rated pressure, and its colours.
        for (const [fraction, burst, length, colour] of [[0, false, 0, 'calm'], [0.25, false, 0.25, 'calm'], [0.6, false, 0.6, 'calm'],
                                                         [0.75, false, 0.75, 'caution'], [1.2, false, 1, 'alarm'], [0, true, 0, 'alarm']]) {
            const bar = await page.eval(`(() => {
                shows(null, {fraction: ${fraction}, nominal: 0.57, burst: ${burst}});
                const all = document.querySelectorAll('.balloon .bar'), track = all[0], whole = track.clientWidth;
                const [r, g, b] = [1, 3, 5].map(at => parseInt(ink.${colour}.slice(at, at + 2), 16));
                return {bars: all.length, height: track.clientHeight, wide: whole / track.closest('section').clientWidth,
                        length: track.firstChild.getBoundingClientRect().width / whole,
                        fits: getComputedStyle(track.firstChild).backgroundColor === \`rgb(\${r}, \${g}, \${b})\`};
            })()`);
            expect(bar.bars === 1 && bar.height > 2 && bar.wide > 0.8 && Math.abs(bar.length - length) < 0.01 && bar.fits,
                   `the balloon's bar at ${fraction}: expected ${length} of its track in '${colour}', found ${JSON.stringify(bar)}`);
        }
        expect(await page.eval(`(() => {
            shows(null, {title: 'Stent', rows: [['Stent', '4 mm']], fraction: null, nominal: null, burst: false});
            return document.querySelectorAll('.balloon').length === 1 && !document.querySelector('.balloon .bar');
        })()`), 'a stent without a balloon: expected no bar');
        const said = complaints(page).filter(({ url }) => !/favicon/.test(url));
        expect(said.length === 0, `expected a silent console, found ${JSON.stringify(said, null, 1)}`);
    } finally {
        await server.stop();
    }
}

/// A solution with a balloon is shown: the engine's readouts move the bar and draw both curves.
async function balloon_is_shown(page, server) {
    await page.go(server.url + 'index.html');
    await page.until(`document.querySelector('[data-exercise=iliac_balloon]')`, 60);
    await page.eval(`document.querySelector('[data-exercise=iliac_balloon] .show') || document.getElementById('open-all').click()`);
    await page.eval(`document.querySelector('[data-exercise=iliac_balloon] .show').click()`);
    await page.until(`document.body.dataset.screen === 'room'`, 60);
    const length = `(() => {
        const bar = document.querySelector('.balloon .bar');
        return bar ? bar.firstChild.getBoundingClientRect().width / bar.clientWidth : -1;
    })()`;
    await page.until(`${length} >= 0`, 60);
    expect(await page.eval(length) < 0.05, `expected a bar that is empty at first, found ${await page.eval(length)}`);
    await sleep(4000);  // the curves are of the last four seconds; no balloon fills the artery yet
    const {green, red, width, height} = await page.eval(`(() => {
        const canvas = document.querySelector('canvas.curves'), inked = ${inked};
        return canvas?.offsetParent ? {green: inked(canvas, '#5cb878'), red: inked(canvas, '#e85648'), width: canvas.clientWidth, height: canvas.clientHeight}
                                    : {green: [], red: [], width: 1, height: 1};
    })()`);
    const some = columns => JSON.stringify(columns.filter((_, k) => k % 20 === 0)), rows = columns => columns.map(([, y]) => y);
    expect(green.length > 0.9 * width && Math.max(...rows(green)) - Math.min(...rows(green)) > 5, `expected an electrocardiogram with beats, found ${some(green)}`);
    expect(red.length > 0.9 * width && Math.min(...rows(red)) > 0.3 * height && Math.max(...rows(red)) < height - 4,
           `expected a curve of pressure above nothing, found ${some(red)}`);
    await page.until(`${length} > 0.4`, 120);
    await page.screenshot(path.join(pictures, 'balloon.png'));
}

const parts = [];
const part = (name, run) => parts.push([name, run]);

(async () => {
    fs.mkdirSync(pictures, { recursive: true });

    part('exercise', () => with_page({ width: 1280, height: 800 }, async (page, server) => {
        const recording = path.join(work, 'straight-001.gw');
        fs.writeFileSync(recording, await whole_exercise(page, server));
        const replayed = spawnSync(program, ['replay', recording, '--cache', path.join(work, 'cache')], { encoding: 'utf8' });
        console.log(`page: ${replayed.stdout.trim()}`);
        expect(replayed.status === 0 && /all equal/.test(replayed.stdout),
               `the recording: expected states that the program reaches too, found: ${replayed.stdout}${replayed.stderr}`);
        const score = spawnSync(program, ['score', recording, '--cache', path.join(work, 'cache')], { encoding: 'utf8' });
        expect(score.status === 0, `score: ${score.stderr}`);
        expect(complaints(page).length === 0, `expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);

        await papers(page);
        expect(complaints(page).length === 0, `expected a silent console, found ${JSON.stringify(complaints(page), null, 1)}`);

        // Without a server: the page that was visited, and its exercise.
        await page.until('navigator.serviceWorker.controller || navigator.serviceWorker.ready.then(() => true)', 60);
        await sleep(3000);
        await page.reload();
        await page.until(`document.querySelector('[data-exercise=straight]')`, 60);
        await page.offline(true);
        await page.reload();
        const again = await open(page, server, 'straight');
        console.log(`page: without a connection the briefing is complete after ${again} ms`);
        await page.offline(false);
    }));
    for (const [name, run] of Object.entries({ map: map_of_briefing, review, inside, patients, folder: without_server, demonstration, reader, 'gone run': gone_run }))
        part(name, () => with_page({}, run));
    part('curves and bar', () => with_page({}, curves_and_bar));
    part('balloon', () => with_page({ width: 1280, height: 800 }, balloon_is_shown));
    part('first image', () => with_page({}, first_image));
    for (const rasteriser of Object.keys(rasterisers))
        part(`images by ${rasteriser}`, () => with_page({}, async (page, server) => {
            if (rasteriser === 'processor') in_worker(server, lacks.webgl);
            await page.go(server.url + 'index.html');
            for (const exercise of ['renal', 'arch', 'coronary']) await images(page, exercise, rasteriser);
        }));
    part('thumbs and gamepad', () => with_page({ width: 390, height: 844 }, thumbs_and_gamepad));
    part('memory', () => with_page({}, memory_of_all));

    for (const [width, height, name] of [[360, 740, 'phone'], [740, 360, 'phone-wide'], [1280, 800, 'laptop'], [3840, 2160, '4k']]) {
        part(`sizes ${name}`, () => with_page({ width, height }, (page, server) => sizes(page, server, name)));
        part(`screens ${name}`, () => with_page({ width, height }, async (page, server) => {
            await page.go(server.url + 'index.html');
            await page.until(`document.querySelector('[data-exercise=renal]')`, 60);
            await page.screenshot(path.join(pictures, `front-${name}.png`));
            const wide = await page.eval('document.documentElement.scrollWidth - innerWidth');
            expect(wide <= 0, `${name}: expected a page as wide as the screen, found one that is ${wide} pixels wider`);
            await page.eval(`document.querySelector('[data-exercise=renal] .show').click()`);
            await page.until(`document.body.dataset.screen === 'room'`, 60);
            await sleep(6000);
            await page.screenshot(path.join(pictures, `room-${name}.png`));
        }));
    }

    // A damaged file: a sentence.
    part('damaged', () => with_page({}, async (page, server) => {
        const files = JSON.parse(fs.readFileSync(path.join(folder, 'exercises.json')));
        const damaged = files.bundles[files.exercises.renal['']].path;
        server.corrupt('/' + damaged);
        await page.go(server.url + 'index.html');
        await page.until(`document.querySelector('[data-exercise=renal]')`, 60);
        await page.eval(`document.querySelector('[data-exercise=renal] .free').click()`);
        await page.until(`/damaged/.test(document.body.innerText)`, 60);
    }));
    // A browser without WebGL 2, or whose WebGL cannot add floats, says so and trains all the same.
    for (const [lack, before] of Object.entries(lacks))
        part(`lacking ${lack}`, () => with_page({}, async (page, server) => {
            in_worker(server, before);
            await page.go(server.url + 'index.html');
            await page.until(`/without a graphics processor/.test(document.getElementById('engine-words').textContent)`, 60);
            await page.eval(`document.querySelector('[data-exercise=renal] .free').click()`);
            await page.until(`document.getElementById('start').offsetParent && !document.getElementById('start').disabled`, 60);
            await page.key('Enter');
            await page.until(`document.body.dataset.screen === 'room'`, 10);
            await hold(page, 3000, 'Space');
            await page.key('KeyV');
            await page.until(`document.getElementById('review').open`, 10);
            await page.until(`(() => {
                const canvas = document.getElementById('review-picture'), {width, height} = canvas;
                const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
                return new Set(data).size > 100;
            })()`, 10);
        }));

    const asked = parts.filter(([name]) => wanted.test(name));
    if (asked.length === 0) throw new Error(`expected some of ${parts.map(([name]) => `'${name}'`).join(', ')}, found '${process.argv[5]}'`);
    for (const [name, run] of asked)
        await run().catch(error => {
            ++failures;
            console.log(`page: ${name}: ${error.message}`);
        });
})().catch(error => {
    ++failures;
    console.log(`page: ${error.message}`);
}).finally(() => {
    fs.rmSync(work, { recursive: true, force: true });
    console.log(failures === 0 ? `page: as promised; pictures in ${pictures}` : `page: ${failures} promises broken`);
    process.exit(failures === 0 ? 0 : 1);
});
