// node app/web/bundles.js PROGRAM ROOT OUT: what the page needs beside its engine. Each exercise is opened once by the
// program, which makes its vessels, walls and patient; each of these files becomes OUT/data/NAME.gz (page/worker.js says
// what is in it). OUT/exercises.json is for the worker:
//
//     {"engine": FILE, "bundles": {"common": FILE…}, "exercises": {"renal": ["anatomy-…", …]}}
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
const cache = path.join(out, '..', 'web-cache');  // kept from one build to the next

function files_below(folder, fits) {
    return fs.readdirSync(folder, { withFileTypes: true }).flatMap(entry => {
        const file = path.join(folder, entry.name);
        return entry.isDirectory() ? files_below(file, fits) : fits(entry.name) ? [file] : [];
    }).sort();
}

function described(file) {
    const data = fs.readFileSync(file);
    return {
        path: path.relative(out, file).split(path.sep).join('/'),
        bytes: data.length,
        hash: crypto.createHash('sha256').update(data).digest('hex')
    };
}

/// `contents`: [[path in the engine, bytes]…].
function bundle(name, contents) {
    const file = path.join(out, 'data', name + '.gz');
    const table = Buffer.from(JSON.stringify(contents.map(([at, data]) => [at, data.length])));
    const length = Buffer.alloc(4);
    length.writeUInt32LE(table.length);
    const whole = Buffer.concat([Buffer.from('SELDWEB1'), length, table, ...contents.map(([, data]) => data)]);
    fs.writeFileSync(file, zlib.gzipSync(whole, { level: 6 }));
    return { ...described(file), holds: contents.map(([at]) => at) };
}

/// The files of the cache that one exercise uses: the program touches those that it reads.
function used_by(name, work) {
    const script = path.join(work, 'look.gw');
    fs.writeFileSync(script, '0 beam on\n');
    const before = Date.now() - 20;
    const ran = spawnSync(program, ['run', name, '--commands', script, '--out', path.join(work, name), '--cache', cache],
                          { encoding: 'utf8' });
    if (ran.status !== 0 && ran.status !== 1) throw new Error(`${name}: ${ran.stderr}`);
    return fs.readdirSync(cache).filter(file => file.endsWith('.bin') &&
                                                fs.statSync(path.join(cache, file)).mtimeMs >= before);
}

fs.mkdirSync(path.join(out, 'data'), { recursive: true });
fs.mkdirSync(path.join(out, 'pictures'), { recursive: true });
fs.mkdirSync(cache, { recursive: true });
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'bundles-'));
try {
    const page = path.join(root, 'app', 'web', 'page');
    const pages = files_below(page, () => true).map(file => {
        const to = path.join(out, path.relative(page, file));
        fs.mkdirSync(path.dirname(to), { recursive: true });
        fs.copyFileSync(file, to);
        return to;
    });
    const assets = path.join(root, 'assets');
    const common = files_below(assets, name => /[.](toml|gw)$/.test(name))
        .map(file => ['/assets/' + path.relative(assets, file), fs.readFileSync(file)]);
    const made = { engine: described(path.join(out, 'seldinger.wasm')), bundles: {}, exercises: {} };
    made.bundles.common = bundle('common', common);
    const names = files_below(path.join(assets, 'scenarios'), name => /[.]toml$/.test(name) && name !== 'benchmark.toml')
        .map(file => path.basename(file, '.toml'));
    for (const [done, name] of names.entries()) {
        if (process.stdout.isTTY) process.stdout.write(`\rweb: patients of exercises ${done + 1} of ${names.length} `);
        made.exercises[name] = used_by(name, work).map(file => {
            const bare = path.basename(file, '.bin');
            made.bundles[bare] ??= bundle(bare, [['/cache/' + file, fs.readFileSync(path.join(cache, file))]]);
            return bare;
        });
        const picture = path.join(assets, 'scenarios', name + '.png');
        if (fs.existsSync(picture)) {
            const to = path.join(out, 'pictures', name + '.png');
            fs.copyFileSync(picture, to);
            pages.push(to);
        }
    }
    if (process.stdout.isTTY) process.stdout.write('\n');
    pages.push(path.join(out, 'seldinger.js'));
    const listed = new Set(Object.values(made.bundles).map(each => path.join(out, each.path)));
    for (const file of files_below(path.join(out, 'data'), () => true)) if (!listed.has(file)) fs.unlinkSync(file);
    const list = path.join(out, 'exercises.json');
    fs.writeFileSync(list, JSON.stringify(made, null, 1));
    const later = Object.entries(made.bundles).map(([name, { path, bytes, hash }]) =>
        ({ path, bytes, hash, ...(name === 'common' ? {} : { later: true }) }));
    fs.writeFileSync(path.join(out, 'files.json'),
                     JSON.stringify([...[...pages, list].filter(file => path.basename(file) !== 'sw.js').map(described),
                                    made.engine, ...later], null, 1));
    const sizes = names.map(name => made.exercises[name].reduce((sum, each) => sum + made.bundles[each].bytes, 0));
    console.log(`web: ${names.length} exercises, the largest ${(Math.max(...sizes) / 1e6).toFixed(1)} MB compressed`);
} finally {
    fs.rmSync(work, { recursive: true, force: true });
}
