// node tests/web/replay.js MODULE ASSETS CACHE RUNS: replays RUNS/NAME/run.gw of each exercise NAME in the engine that
// browsers have, and compares its states with those that the program recorded. Code 1 where one differs.
const fs = require('fs');
const path = require('path');
const [module_file, assets, cache, runs] = process.argv.slice(2);

function put(FS, from, to) {
    FS.mkdir(to);
    for (const name of fs.readdirSync(from)) {
        const file = path.join(from, name);
        if (fs.statSync(file).isDirectory()) put(FS, file, to + '/' + name);
        else if (!/\.(png|lock|part)$/.test(name)) FS.writeFile(to + '/' + name, fs.readFileSync(file));
    }
}

require(path.resolve(module_file))().then(engine => {
    put(engine.FS, assets, '/assets');
    put(engine.FS, cache, '/cache');
    let frames = 0, states = 0, wrong = 0, exercises = 0;
    for (const name of fs.readdirSync(runs)) {
        engine.FS.writeFile('/run.gw', fs.readFileSync(path.join(runs, name, 'run.gw')));
        const said = JSON.parse(engine.ccall('seldinger_replay', 'string', ['string', 'string'],
                                             ['/assets/scenarios/' + name + '.toml', '/run.gw']));
        ++exercises;
        if (said.error) {
            console.log(`${name}: ${said.error}`);
            ++wrong;
            continue;
        }
        frames += said.frames;
        states += said.states;
        if (said.differences.length === 0) continue;
        ++wrong;
        const first = said.differences[0];
        console.log(`${name}: ${said.differences.length} of ${said.states} states differ, the first at frame ` +
                    `${first.frame}: found ${first.found}, expected ${first.expected}`);
    }
    console.log(`web: ${exercises} recordings, ${frames} frames, ${states} states compared, ` +
                `${wrong === 0 ? 'all equal' : wrong + ' recordings with differences'}`);
    process.exitCode = wrong === 0 && states > 0 ? 0 : 1;
});
