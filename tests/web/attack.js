// node tests/web/attack.js MODULE ASSETS [SEED [CASES]]: calls the page's engine with what no page sends: random JSON and
// random text, in random order. Each call must be answered by JSON; the engine must still be there at the end.
'use strict';
const fs = require('fs');
const path = require('path');
const [module_file, assets, given = String(Date.now() % 1e6), cases = '2000'] = process.argv.slice(2);

let state = Number(given) >>> 0 || 1;
function below(count) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor(state / 2 ** 32 * count);
}
const one_of = list => list[below(list.length)];

const names = ['exercise', 'free', 'solution', 'learner', 'speed', 'replay', 'held', 'pressed', 'injections', 'wheel', 'dragUp',
               'push', 'turn', 'armLao', 'tableLeft', 'run', 'image', 'mask', 'shiftX', 'window', 'recording', 'to', 'files', 'name',
               'patient', 'ruler', 'calibrate', 'isocentre'];
function value(depth = 0) {
    const kinds = [() => null, () => true, () => below(10) - 5, () => one_of([1e308, -1e308, 2 ** 31, -(2 ** 31), 2 ** 63, 0.5]),
                   () => one_of(['', 'renal', 'straight', 'advance', 'fluoroscopy', '../../x', '/assets/scenarios/straight.toml',
                                 '\u0000', 'é'.repeat(below(100)), '/no/such/file']),
                   () => Array.from({ length: below(5) }, () => value(depth + 1)), () => object(depth + 1)];
    return kinds[below(depth > 3 ? 5 : kinds.length)]();
}
function object(depth = 0) {
    return Object.fromEntries(Array.from({ length: below(6) }, () => [one_of(names), value(depth)]));
}

function put(FS, from, to) {
    FS.mkdir(to);
    for (const name of fs.readdirSync(from)) {
        const file = path.join(from, name);
        if (fs.statSync(file).isDirectory()) put(FS, file, to + '/' + name);
        else if (/\.(toml|gw)$/.test(name)) FS.writeFile(to + '/' + name, fs.readFileSync(file));
    }
}

// Node has none: as in a browser without WebGL 2.
globalThis.WebGLRenderingContext ??= class {};
globalThis.WebGL2RenderingContext ??= class {};
globalThis.OffscreenCanvas ??= class {
    constructor(width, height) {
        Object.assign(this, { width, height });
    }
    getContext() {
        return null;
    }
    addEventListener() {}
};
require(path.resolve(module_file))({ print: () => {}, printErr: () => {} }).then(engine => {
    put(engine.FS, assets, '/assets');
    engine.FS.mkdir('/cache');
    const call = (name, ...texts) =>
        JSON.parse(engine.ccall('seldinger_' + name, 'string', texts.map(() => 'string'), texts));
    if (call('begin').exercises.length < 20) throw new Error('expected exercises, found none');
    let refused = 0;
    for (let k = 0; k < Number(cases); ++k) {
        const name = one_of(['open', 'give', 'look', 'control', 'turn', 'briefing', 'end', 'close', 'debrief', 'course', 'about', 'unpack',
                             'measure', 'inside']);
        const text = below(4) === 0 ? one_of(['', '{', 'null', '[]', '"', '[[[[', '{"held":', '\u00e9', 'start', 'lookInside', 'lookAway']) : JSON.stringify(one_of([object, value])());
        engine.ccall('seldinger_speed', 'string', ['number'], [one_of([0, -1, 4, 1e308, NaN, Infinity])]);
        try {
            refused += 'error' in (['turn', 'briefing', 'end', 'close', 'inside'].includes(name) ? call(name) : call(name, text)) ? 1 : 0;
        } catch (error) {
            console.log(`attack: seed ${given}, case ${k}: ${name}(${text.slice(0, 200)}): ${error.message}`);
            process.exit(1);
        }
    }
    call('close');
    if (call('begin').exercises.length < 20) throw new Error('expected exercises still, found none');
    console.log(`attack: seed ${given}: ${cases} calls, ${refused} refused in a sentence, all answered`);
});
