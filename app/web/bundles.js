// node app/web/bundles.js PROGRAM ROOT OUT: what the page needs beside its engine. The program makes vessels, walls and
// patient of each exercise and packs them (`seldinger bake --for-web`); each of these is OUT/data/HASH.gz, once for all
// exercises that share it. OUT/exercises.json is for the worker:
//
//     {"engine": FILE, "assets": FILE, "bundles": {HASH: FILE…}, "exercises": {"renal": HASH, "straight": null, …}}
//
// and OUT/files.json, a list of all FILEs, for the service worker. FILE = {"path", "bytes", "hash"}, the hash SHA-256.
'use strict';
const { spawnSync } = require('child_process');
const crypto = require('crypto');
const fs = require('fs');
const os = require('os');
const path = require('path');
const zlib = require('zlib');

const [program, root, out] = process.argv.slice(2).map(given => path.resolve(given));

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

function compressed(name, data) {
    const file = path.join(out, 'data', name + '.gz');
    fs.writeFileSync(file, zlib.gzipSync(data, { level: 9 }));
    return described(file);
}

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

/// Vessels, walls and patient of an exercise.
function patient_of(name, work) {
    const file = path.join(work, name);
    const ran = spawnSync(program, ['bake', name, '--for-web', file], { encoding: 'utf8' });
    if (ran.status !== 0) throw new Error(`${name}: ${ran.stderr.trim() || ran.error}`);
    return fs.readFileSync(file);
}

function copied(from, to) {
    fs.mkdirSync(path.dirname(to), { recursive: true });
    fs.copyFileSync(from, to);
    return to;
}

fs.mkdirSync(path.join(out, 'data'), { recursive: true });
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'bundles-'));
try {
    const page = path.join(root, 'app', 'web', 'page'), scenarios = path.join(root, 'assets', 'scenarios');
    const pages = [path.join(out, 'seldinger.js'),
                   ...files_below(page, () => true).map(file => copied(file, path.join(out, path.relative(page, file))))];
    const made = { engine: described(path.join(out, 'seldinger.wasm')), assets: assets(), bundles: {}, exercises: {} };
    const names = files_below(scenarios, name => /[.]toml$/.test(name) && name !== 'benchmark.toml')
        .map(file => path.basename(file, '.toml'));
    for (const [done, name] of names.entries()) {
        if (process.stdout.isTTY) process.stdout.write(`\rweb: patients of exercises ${done + 1} of ${names.length} `);
        const picture = path.join(scenarios, name + '.png');
        if (fs.existsSync(picture)) pages.push(copied(picture, path.join(out, 'pictures', name + '.png')));
        const is_tube = !/^\[anatomy\]/m.test(fs.readFileSync(path.join(scenarios, name + '.toml'), 'utf8'));
        const data = is_tube ? null : patient_of(name, work), hash = data && hash_of(data).slice(0, 16);
        if (data) made.bundles[hash] ??= compressed(hash, data);
        made.exercises[name] = hash;
    }
    if (process.stdout.isTTY) process.stdout.write('\n');
    const list = path.join(out, 'exercises.json');
    fs.writeFileSync(list, JSON.stringify(made, null, 1));
    const later = Object.values(made.bundles).map(file => ({ ...file, later: true }));
    fs.writeFileSync(path.join(out, 'files.json'),
                     JSON.stringify([...[...pages, list].filter(file => path.basename(file) !== 'sw.js').map(described),
                                     made.engine, made.assets, ...later], null, 1));
    const listed = new Set([made.assets, ...later].map(file => path.join(out, file.path)));
    for (const file of files_below(path.join(out, 'data'), () => true)) if (!listed.has(file)) fs.unlinkSync(file);
    const sizes = later.map(({ bytes }) => bytes / 1e6);
    console.log(`web: ${names.length} exercises, ${later.length} patients of ${Math.min(...sizes).toFixed(1)} to ` +
                `${Math.max(...sizes).toFixed(1)} MB compressed, ${sizes.reduce((a, b) => a + b, 0).toFixed(0)} MB in all`);
} finally {
    fs.rmSync(work, { recursive: true, force: true });
}
