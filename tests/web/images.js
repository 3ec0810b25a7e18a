// Images of the page's engine beside those of the program: what tests/web/page_test.js compares.
'use strict';
const fs = require('fs');
const zlib = require('zlib');

/// A grey PNG of 8 bits, as the program writes them: {width, height, pixels}.
function read_png(file) {
    const data = fs.readFileSync(file), parts = [];
    let width = 0, height = 0;
    for (let at = 8; at < data.length;) {
        const length = data.readUInt32BE(at), kind = data.toString('latin1', at + 4, at + 8);
        const body = data.subarray(at + 8, at + 8 + length);
        if (kind === 'IHDR') {
            width = body.readUInt32BE(0), height = body.readUInt32BE(4);
            if (body[8] !== 8 || body[9] !== 0) throw new Error(`${file}: expected grey values of 8 bits`);
        }
        if (kind === 'IDAT') parts.push(body);
        at += 12 + length;
    }
    const rows = zlib.inflateSync(Buffer.concat(parts)), pixels = new Uint8Array(width * height);
    for (let y = 0; y < height; ++y) {
        const filter = rows[y * (width + 1)];
        for (let x = 0; x < width; ++x) {
            const at = y * width + x, left = x > 0 ? pixels[at - 1] : 0, up = y > 0 ? pixels[at - width] : 0,
                  corner = x > 0 && y > 0 ? pixels[at - width - 1] : 0;
            const guess = left + up - corner;
            const paeth = [left, up, corner].reduce((a, b) => (Math.abs(guess - b) < Math.abs(guess - a) ? b : a));
            pixels[at] = rows[y * (width + 1) + 1 + x] + [0, left, up, (left + up) >> 1, paeth][filter];
        }
    }
    return { width, height, pixels };
}

/// The measures of tests/frames/comparison.h that need no wire.
function compare(expected, found) {
    const tile = 16, across = Math.ceil(expected.width / tile), sums = [];
    let sum = 0, largest = 0;
    for (let y = 0; y < expected.height; ++y)
        for (let x = 0; x < expected.width; ++x) {
            const off = Math.abs(expected.pixels[y * expected.width + x] - found.pixels[y * expected.width + x]);
            sum += off;
            largest = Math.max(largest, off);
            const at = Math.floor(y / tile) * across + Math.floor(x / tile);
            sums[at] ??= [0, 0];
            sums[at][0] += off;
            ++sums[at][1];
        }
    return {
        mean_difference: sum / expected.pixels.length,
        largest_difference: largest,
        tile_difference: Math.max(...sums.map(([of, pixels]) => of / pixels))
    };
}

/// Images of a solution in the page's own engine, by frames, and whether they were drawn without OpenGL:
/// {software, images: {frame: {width, height, pixels}}}. To be called in any page of the folder.
async function images_of(page, exercise, frames) {
    const shown = await page.eval(`new Promise((resolve, reject) => {
        const wanted = ${JSON.stringify(frames)}, found = {}, worker = new Worker('worker.js');
        let software;
        worker.onmessage = ({data}) => {
            if (data.is === 'ready') software = data.software;
            if (data.is === 'ready')
                worker.postMessage({do: 'open', exercise: '${exercise}', solution: true, speed: 100, learner: ''});
            if (data.is === 'briefing') worker.postMessage({do: 'start'});
            if (data.is === 'view' && data.image && wanted.includes(data.frame - 1)) {
                let text = '';
                for (const value of data.image.pixels) text += String.fromCharCode(value);
                found[data.frame - 1] = {width: data.image.width, height: data.image.height, pixels: btoa(text)};
            }
            if (data.is === 'failed') reject(new Error(data.error));
            if (data.is === 'end' || data.is === 'failed') {
                worker.terminate();
                resolve({software, images: found});
            }
        };
    })`);
    for (const image of Object.values(shown.images)) image.pixels = new Uint8Array(Buffer.from(image.pixels, 'base64'));
    return shown;
}

module.exports = { read_png, compare, images_of };
