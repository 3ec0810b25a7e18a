// node app/web/bundles.js PROGRAM ROOT ENGINE OUT [--patients N] [--keep]: the page as it is served, or opened as a file.
// ENGINE is the folder of seldinger.js and seldinger.wasm. The program makes vessels, walls and patient of each exercise,
// and of up to N other patients of it, and packs them (`seldinger bake --for-web`); each of these is OUT/data/HASH.js, once
// for all exercises that share it. --keep: patients are those that OUT has, when the page alone has changed.
//
// A page opened as a file may read nothing but scripts. So page.js has all modules of app/web/page in one; worker.js has
// the engine's script and the worker's in a function, which a page of a server runs as a worker, and another one as a worker
// made of its text; and what has bytes is a script with a string of them. OUT/exercises.json, for --keep, is in worker.js:
//
//     {"engine": FILE, "assets": FILE, "bundles": {HASH: FILE…}, "exercises": {"renal": {"": HASH, "2": HASH…}, "straight": {"": null}, …}}
//
// OUT/files.json lists all FILEs, for the service worker. FILE = {"path", "bytes", "hash"}, the hash SHA-256.
'use strict';
const { spawnSync } = require('child_process');
const crypto = require('crypto');
const fs = require('fs');
const os = require('os');
const path = require('path');
const zlib = require('zlib');

const words = process.argv.slice(2), keeps = words.includes('--keep');
const asked = words.indexOf('--patients'), others = asked < 0 ? 0 : Number(words[asked + 1]);
const [program, root, engine, out] = words.slice(0, 4).map(given => path.resolve(given));
if (!out || !(Number.isInteger(others) && others >= 0))
    throw new Error('expected PROGRAM ROOT ENGINE OUT, and a number of patients after --patients');

function files_below(folder, fits) {
    return fs.readdirSync(folder, { withFileTypes: true }).flatMap(entry => {
        const file = path.join(folder, entry.name);
        return entry.isDirectory() ? files_below(file, fits) : fits(entry.name) ? [file] : [];
    }).sort();
}

const hash_of = data => crypto.createHash('sha256').update(data).digest('hex');

function described(file) {
    const data = fs.readFileSync(file);
    return { path: path.relative(out, file).split(path.sep).join('/'), bytes: data.length, hash: hash_of(data) };
}

function written(name, content) {
    const file = path.join(out, name);
    fs.mkdirSync(path.dirname(file), { recursive: true });
    fs.writeFileSync(file, content);
    return file;
}

// ---- Bytes as a script

/// Fifteen bits a character, from U+3000 on, in UTF-16: none of these is half of a pair, ends a line or a string. The script
/// is 1/15 longer than the bytes; in base64 it would be a third.
function as_script(name, data) {
    const head = Buffer.from(`\ufeffseldingerFile('${name}',${data.length},'`, 'utf16le'), tail = Buffer.from("')\n", 'utf16le');
    const units = Buffer.alloc(2 * Math.ceil(8 * data.length / 15));
    let bits = 0, value = 0, at = 0;
    for (const byte of data) {
        value = value << 8 | byte;
        bits += 8;
        if (bits < 15) continue;
        bits -= 15;
        units.writeUInt16LE(0x3000 + (value >>> bits & 0x7fff), at);
        value &= (1 << bits) - 1;
        at += 2;
    }
    if (bits) units.writeUInt16LE(0x3000 + (value << 15 - bits & 0x7fff), at);
    return Buffer.concat([head, units, tail]);
}

const compressed = (name, data) =>
    described(written(`data/${name}.js`, as_script(`data/${name}.js`, zlib.gzipSync(data, { level: 9 }))));

// ---- Scripts of the page

/// Modules in one script, each a function that returns what it exports. They are written as the page's are: imports by
/// name at the beginnings of lines, exports before declarations.
function joined(folder, first) {
    const made = [], seen = new Set();
    const take = file => {
        if (seen.has(file)) return;
        seen.add(file);
        const exported = [];
        const text = fs.readFileSync(path.join(folder, file), 'utf8')
            .replace(/^import\s+(\{[^}]*\})\s+from\s+'\.\/([\w.]+)';$/gm, (all, names, from) => {
                take(from);
                return `const ${names.replace(/ as /g, ': ')} = modules['${from}'];`;
            })
            .replace(/^export ((?:async )?(?:const|let|class|function)) ([\w$]+)/gm, (all, kind, name) => {
                exported.push(name);
                return `${kind} ${name}`;
            });
        if (/^(import|export)\b/m.test(text)) throw new Error(`${file}: expected imports and exports as in the other modules`);
        made.push(`modules['${file}'] = (() => {\n${text}\nreturn {${exported.join(', ')}};\n})();\n`);
    };
    take(first);
    return `'use strict';\n(() => {\nconst modules = {};\n${made.join('')}})();\n`;
}

function worker_script(files) {
    const engine_script = fs.readFileSync(path.join(engine, 'seldinger.js'), 'utf8');
    const worker = fs.readFileSync(path.join(root, 'app/web/page/worker.js'), 'utf8');
    return `function seldingerWorker() {\nself.seldingerFiles = ${JSON.stringify(files)};\n${engine_script}\n` +
           `(() => {\n${worker}\n})();\n}\nif (typeof document === 'undefined') seldingerWorker();\n`;
}

// ---- What exercises need

/// Scenarios, devices, keys and solutions, as page/worker.js takes them apart.
function assets() {
    const folder = path.join(root, 'assets');
    const contents = files_below(folder, name => /[.](toml|gw)$/.test(name))
        .map(file => ['/assets/' + path.relative(folder, file), fs.readFileSync(file)]);
    const table = Buffer.from(JSON.stringify(contents.map(([at, data]) => [at, data.length])));
    const length = Buffer.alloc(4);
    length.writeUInt32LE(table.length);
    return compressed('assets', Buffer.concat([Buffer.from('SELDWEB1'), length, table, ...contents.map(([, data]) => data)]));
}

/// Vessels, walls and body of a patient of an exercise.
function patient_of(name, word, work) {
    const file = path.join(work, name);
    const ran = spawnSync(program, ['bake', name, '--for-web', file, ...word ? ['--patient', word] : []], { encoding: 'utf8' });
    if (ran.status !== 0) throw new Error(`${name}${word && `, patient ${word}`}: ${ran.stderr.trim() || ran.error}`);
    return fs.readFileSync(file);
}

function patients(made, scenarios, names, work) {
    for (const [done, name] of names.entries()) {
        if (process.stdout.isTTY) process.stdout.write(`\rweb: patients of exercises ${done + 1} of ${names.length} `);
        const text = fs.readFileSync(path.join(scenarios, name + '.toml'), 'utf8'), is_tube = !/^\[anatomy\]/m.test(text);
        const more = Math.min(others, (text.match(/^\[\[lesson\.patient\]\]/gm) ?? []).length);
        made.exercises[name] = {};
        for (const word of ['', ...Array.from({ length: more }, (_, k) => String(k + 2))]) {
            const data = is_tube ? null : patient_of(name, word, work), hash = data && hash_of(data).slice(0, 16);
            if (data) made.bundles[hash] ??= compressed(hash, data);
            made.exercises[name][word] = hash;
        }
    }
    if (process.stdout.isTTY) process.stdout.write('\n');
}

const work = fs.mkdtempSync(path.join(os.tmpdir(), 'bundles-'));
try {
    const page = path.join(root, 'app', 'web', 'page'), scenarios = path.join(root, 'assets', 'scenarios');
    const names = files_below(scenarios, name => /[.]toml$/.test(name) && name !== 'benchmark.toml')
        .map(file => path.basename(file, '.toml'));
    const made = { engine: compressed('engine', fs.readFileSync(path.join(engine, 'seldinger.wasm'))), assets: assets(),
                   bundles: {}, exercises: {} };
    if (keeps) {
        const { bundles, exercises } = JSON.parse(fs.readFileSync(path.join(out, 'exercises.json')));
        Object.assign(made, { bundles, exercises });
    } else {
        patients(made, scenarios, names, work);
    }
    written('exercises.json', JSON.stringify(made, null, 1));
    const pages = [written('page.js', joined(page, 'page.js')), written('worker.js', worker_script(made)),
                   ...files_below(page, name => !name.endsWith('.js') || name === 'sw.js')
                       .map(file => written(path.relative(page, file), fs.readFileSync(file))),
                   ...names.map(name => path.join(scenarios, name + '.png')).filter(file => fs.existsSync(file))
                       .map(file => written(`pictures/${path.basename(file)}`, fs.readFileSync(file)))];
    const later = Object.values(made.bundles).map(file => ({ ...file, later: true }));
    written('files.json', JSON.stringify([...pages.filter(file => path.basename(file) !== 'sw.js').map(described),
                                          made.engine, made.assets, ...later], null, 1));
    const listed = new Set([...pages, path.join(out, 'exercises.json'), path.join(out, 'files.json'),
                            ...[made.engine, made.assets, ...later].map(file => path.join(out, file.path))]);
    for (const file of files_below(out, () => true)) if (!listed.has(file)) fs.unlinkSync(file);
    const sizes = later.map(({ bytes }) => bytes / 1e6);
    console.log(`web: ${names.length} exercises, ${later.length} patients of ${Math.min(...sizes).toFixed(1)} to ` +
                `${Math.max(...sizes).toFixed(1)} MB, ${sizes.reduce((a, b) => a + b, 0).toFixed(0)} MB in all; ` +
                `the engine has ${(made.engine.bytes / 1e6).toFixed(1)} MB`);
} finally {
    fs.rmSync(work, { recursive: true, force: true });
}
