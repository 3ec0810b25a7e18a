// The engine in a worker: loads the engine and the files of exercises, gives the engine its turns, and passes messages
// between it and the page. `is` names what a message to the page is, `do` what the page asks for. bundles.js puts the
// engine's script, and seldingerFiles, before this one.
'use strict';

const files = self.seldingerFiles;
// A page that was opened as a file can read scripts alone: it hands over what they hold.
const inFolder = self.location.protocol === 'blob:';
let engine, latest = null, opened = null, timer = 0, ended = false;

/// Of the exercise that was asked for last, by the number that the page gave it.
function tell(message, moved = []) {
    postMessage({...message, attempt: latest?.attempt}, moved);
}

function call(name, ...given) {
    const types = given.map(value => (typeof value === 'number' ? 'number' : 'string'));
    const said = JSON.parse(engine.ccall('seldinger_' + name, 'string', types, given));
    if (said.error) throw new Error(said.error);
    return said;
}

// ---- Files

async function fetched(entry, told) {
    const answer = await fetch(entry.path);
    if (!answer.ok)
        throw new Error(`${entry.path}: expected the file, found HTTP status ${answer.status} (${answer.statusText})`);
    const reader = answer.body.getReader(), data = new Uint8Array(entry.bytes);
    let size = 0;
    for (;;) {
        const {done, value} = await reader.read();
        if (done) break;
        if (size + value.length <= data.length) data.set(value, size);
        size += value.length;
        told(size);
    }
    if (size !== entry.bytes) throw new Error(`${entry.path}: expected ${entry.bytes} bytes, found ${size}`);
    if (self.crypto && crypto.subtle) {  // not on pages without HTTPS, but for those of this computer
        const hash = [...new Uint8Array(await crypto.subtle.digest('SHA-256', data))];
        const text = hash.map(byte => byte.toString(16).padStart(2, '0')).join('');
        if (text !== entry.hash) throw new Error(`${entry.path}: the file is damaged; expected SHA-256 ${entry.hash}, found ${text}`);
    }
    return data;
}

const handed = new Map();  // path → what takes its file
function asked_of_page(entry) {
    return new Promise((resolve, reject) => {
        handed.set(entry.path, ({size, text, error}) => error ? reject(new Error(error)) : resolve({size, text}));
        postMessage({is: 'want', path: entry.path});
    });
}

/// Fifteen bits of each character from U+3000 on (bundles.js); `at(k)` is the k-th character.
function decoded(at, size) {
    const data = new Uint8Array(size);
    let value = 0, bits = 0, from = 0;
    for (let k = 0; k < size; ++k) {
        if (bits < 8) {
            value = value << 15 | at(from++) - 0x3000;
            bits += 15;
        }
        bits -= 8;
        data[k] = value >>> bits;
        value &= (1 << bits) - 1;
    }
    return data;
}

/// What the script of an entry holds.
async function bytes_of(entry, told = () => {}) {
    if (inFolder) {
        const {size, text} = await asked_of_page(entry);
        told(entry.bytes);
        return decoded(k => text.charCodeAt(k), size);
    }
    const data = await fetched(entry, told), units = new Uint16Array(data.buffer);
    const head = /^\ufeffseldingerFile\('[^']*',(\d+),'/.exec(String.fromCharCode(...units.subarray(0, 200)));
    if (!head) throw new Error(`${entry.path}: expected a file of Seldinger, found something else`);
    return decoded(k => units[head[0].length + k], Number(head[1]));
}

async function unpacked(data, name) {
    try {
        const stream = new Blob([data]).stream().pipeThrough(new DecompressionStream('gzip'));
        return new Uint8Array(await new Response(stream).arrayBuffer());
    } catch (error) {
        throw new Error(`${name}: the file is damaged: expected gzip data, found something else (${error.message})`);
    }
}

// Assets: 'SELDWEB1', the length of a table (4 bytes, little endian), the table [[path, bytes]…] as JSON, contents.
function put_assets(bundle, name) {
    const text = new TextDecoder();
    if (text.decode(bundle.subarray(0, 8)) !== 'SELDWEB1')
        throw new Error(`${name}: expected files of Seldinger, found something else`);
    const length = new DataView(bundle.buffer, bundle.byteOffset).getUint32(8, true);
    let at = 12 + length;
    for (const [path, size] of JSON.parse(text.decode(bundle.subarray(12, at)))) {
        if (at + size > bundle.length) throw new Error(`${name}: ends within ${path}`);
        engine.FS.mkdirTree(path.slice(0, path.lastIndexOf('/')));
        engine.FS.writeFile(path, bundle.subarray(at, at + size));
        at += size;
    }
}

// The patient of an exercise, which others may have too: vessels, walls and body. One at a time is in the engine's cache.
let patient = {bundle: null, holds: [], kept: null};  // kept: whether the browser has its files too, once that is known
async function fetch_exercise(name, word = '') {
    if (!(name in files.exercises)) throw new Error(`expected the name of an exercise, found '${name}'`);
    if (!(word in files.exercises[name])) throw new Error(`${name}: patient ${word} is not among those of this page (app/web.sh --patients)`);
    const bundle = files.exercises[name][word];
    if (!bundle || bundle === patient.bundle) return;
    const entry = files.bundles[bundle], told = (part, doing) => tell({is: 'loading', exercise: name, part, doing});
    forget_patient();
    let holds = await unpacked_before(bundle), kept = Promise.resolve(true);
    if (!holds) {
        const data = await unpacked(await bytes_of(entry, size => told(0.4 * size / entry.bytes, 'fetching the patient')), entry.path);
        told(0.4, 'unpacking the patient');
        engine.FS.writeFile('/patient.bin', data, {canOwn: true});
        try {
            holds = call('unpack', '/patient.bin');
        } finally {
            engine.FS.unlink('/patient.bin');
        }
        kept = keep_unpacked(bundle, holds);
    }
    patient = {bundle, holds, kept};
}
function forget_patient() {
    for (const path of patient.holds) engine.FS.unlink(path);
    patient = {bundle: null, holds: [], kept: null};
}
/// What the engine has read need not be there twice, where it can be had again at once.
async function forget_what_is_kept() {
    const read = patient;
    if (await read.kept && read === patient) forget_patient();
}

// Unpacking takes seconds: the last patients are kept unpacked too, where the browser keeps anything.
const most_kept = 3;
async function unpacked_before(bundle) {
    try {
        const cache = await caches.open('seldinger-patients'), list = await cache.match(bundle);
        if (!list) return null;
        const holds = await list.json();
        for (const path of holds) engine.FS.writeFile(path, new Uint8Array(await (await cache.match(bundle + path)).arrayBuffer()), {canOwn: true});
        return holds;
    } catch {
        return null;
    }
}
async function keep_unpacked(bundle, holds) {
    try {
        const cache = await caches.open('seldinger-patients');
        const lists = (await cache.keys()).filter(({url}) => !url.endsWith('.bin'));
        for (const list of lists.slice(0, Math.max(0, lists.length + 1 - most_kept)))
            for (const {url} of await cache.keys()) if (url.startsWith(list.url)) await cache.delete(url);
        for (const path of holds) await cache.put(bundle + path, new Response(engine.FS.readFile(path)));
        await cache.put(bundle, new Response(JSON.stringify(holds)));
        return true;
    } catch {
        return false;  // it is unpacked again
    }
}

// ---- Images

function image_of(which, size) {
    if (!size) return null;
    const at = engine.ccall('seldinger_pixels', 'number', ['number'], [which]);
    return {...size, pixels: engine.HEAPU8.slice(at, at + size.width * size.height)};
}

function post_view(view) {
    const moved = [];
    for (const [name, which] of [['image', 0], ['reference', 1]]) {
        if (!(name in view)) continue;
        view[name] = image_of(which, view[name]);
        if (view[name]) moved.push(view[name].pixels.buffer);
    }
    tell({is: 'view', ...view}, moved);
}

/// What is new in the view into the patient.
let looksInside = false;
function post_inside() {
    if (!looksInside || !opened) return;
    const told = call('inside'), moved = [];
    if (!told.meshes) return;
    told.meshes.forEach((mesh, k) => {
        const at = indices => engine.ccall('seldinger_mesh', 'number', ['number', 'number'], [k, indices]);
        const from = at(0), to = at(1), {buffer} = engine.HEAPU8;
        mesh.vertices = new Float32Array(buffer.slice(from, from + 36 * mesh.vertices));
        mesh.indices = new Uint32Array(buffer.slice(to, to + 4 * mesh.indices));
        moved.push(mesh.vertices.buffer, mesh.indices.buffer);
    });
    tell({is: 'inside', ...told}, moved);
}

// ---- The exercise's turns

function turn() {
    clearTimeout(timer);
    if (!opened) return;
    let said;
    try {
        said = call('turn');
    } catch (error) {
        return fail(error);
    }
    const view = said.view;
    if (view) {
        if (view.phase === 'failed') return fail(new Error(view.error));
        if (opened.phase !== view.phase && view.phase === 'ready') {
            tell({is: 'briefing', ...call('briefing')});
            forget_what_is_kept();
        }
        opened.phase = view.phase;
        post_view(view);
        post_inside();
        if (view.phase === 'ended' && !ended) {
            ended = true;
            post_end();
        }
    }
    if (said.next !== null) timer = setTimeout(turn, said.next);
}

function post_end() {
    const end = call('end');
    let recording = null;
    if (end.file) {
        const bytes = engine.FS.readFile(end.file);
        recording = {name: end.file.slice(end.file.lastIndexOf('/') + 1), bytes};
    }
    delete end.file;
    tell({is: 'end', ...end, recording});
}

function fail(error) {
    clearTimeout(timer);
    opened = null;
    tell({is: 'failed', error: String(error.message || error)});
}

async function open(wanted) {
    clearTimeout(timer);
    opened = null;
    const mine = {exercise: wanted.exercise, attempt: wanted.attempt, phase: ''};
    latest = mine;
    looksInside = false;
    call('close');
    await fetch_exercise(wanted.exercise, wanted.patient);
    if (latest !== mine) return;  // another one was asked for meanwhile
    if (wanted.replay) {
        engine.FS.writeFile('/replay.gw', wanted.replay);
        wanted = {...wanted, replay: '/replay.gw'};
    } else {
        wanted = {...wanted, replay: null};
    }
    call('open', JSON.stringify(wanted));
    opened = mine;
    ended = false;
    progress_of = {exercise: wanted.exercise, from: 0.5, doing: ''};
    turn();
}
let progress_of = {exercise: '', from: 0, doing: ''};

const acts = {
    open,
    close() {
        latest = opened = null;
        clearTimeout(timer);
        call('close');
    },
    input(input) {
        call('give', JSON.stringify(input));
    },
    keyPressed({action}) {
        call('control', action);
        turn();
    },
    // A recording of any exercise: its own files are fetched.
    async debrief({recording, name}) {
        engine.FS.writeFile('/debriefed.gw', recording);
        const {exercise, patient: word} = call('about', '/debriefed.gw');
        if (opened && patient.bundle !== files.exercises[exercise]?.[word]) acts.close();
        await fetch_exercise(exercise, word);
        progress_of = {exercise, from: 0, doing: 'making the debriefing'};
        call('debrief', JSON.stringify({exercise, recording: '/debriefed.gw', name, to: '/debriefing.html'}));
        postMessage({is: 'debriefing', html: engine.FS.readFile('/debriefing.html', {encoding: 'utf8'})});
    },
    // Recordings of any exercises: those of one exercise after those of another are played, as their files come.
    async course({recordings, title}) {
        acts.close();
        const folder = '/course', groups = new Map(), paths = [];
        engine.FS.mkdirTree(folder);
        try {
            for (const {name, bytes} of recordings) {
                const path = `${folder}/${paths.length}-${name.replaceAll('/', '_')}`;
                engine.FS.writeFile(path, bytes);
                paths.push(path);
                let about = null;
                try {
                    about = call('about', path);
                } catch {
                    continue;  // it does not count, and the page says why
                }
                if (files.exercises[about.exercise]?.[about.patient] === undefined) continue;
                const group = JSON.stringify([about.exercise, about.patient]);
                if (!groups.has(group)) groups.set(group, []);
                groups.get(group).push(path);
            }
            for (const [group, its] of groups) {
                const [exercise, word] = JSON.parse(group);
                await fetch_exercise(exercise, word);
                progress_of = {exercise, from: 0, doing: 'playing the recordings'};
                call('course', JSON.stringify({files: its}));
            }
            call('course', JSON.stringify({files: paths, to: '/course.html', title: title || 'Course'}));
            postMessage({is: 'course', html: engine.FS.readFile('/course.html', {encoding: 'utf8'})});
        } finally {
            for (const path of paths) engine.FS.unlink(path);
        }
    },
    // What recordings name: [{exercise, learner, patient}, …], each with an error where it names nothing that is here.
    about({recordings}) {
        postMessage({is: 'about', all: recordings.map(bytes => {
            try {
                engine.FS.writeFile('/about.gw', bytes);
                const about = call('about', '/about.gw');
                if (files.exercises[about.exercise]?.[about.patient] === undefined) throw new Error(`${about.exercise}: not in this page`);
                return about;
            } catch (error) {
                return {error: error.message};
            }
        })});
    },
    speed({factor}) {
        engine.ccall('seldinger_speed', 'string', ['number'], [factor]);
        turn();
    },
    inside({is}) {
        looksInside = is;
        call('control', is ? 'lookInside' : 'lookAway');
        turn();
        post_inside();
    },
    // A run may be gone since the page has heard of it: no reason to end the exercise.
    measure(wanted) {
        postMessage({is: 'measured', run: wanted.run, ...tried(() => call('measure', JSON.stringify(wanted)))});
    },
    look(wanted) {
        const told = tried(() => call('look', JSON.stringify(wanted)));
        if (told.error) return postMessage({is: 'picture', run: wanted.run, ...told});
        const {width, height, ...about} = told, image = image_of(2, {width, height});
        postMessage({is: 'picture', ...about, ...image}, [image.pixels.buffer]);
    }
};
function tried(work) {
    try {
        return work();
    } catch (error) {
        return {error: error.message};
    }
}
for (const word of ['start', 'pause', 'resume', 'takeBack', 'finish', 'skipStep'])
    acts[word] = () => {
        call('control', word);
        turn();
    };

let queue = Promise.resolve();
onmessage = ({data}) => {
    if (data.do === 'file') {
        handed.get(data.path)?.(data);
        handed.delete(data.path);
        return;
    }
    queue = queue.then(() => {
        const act = acts[data.do];
        if (!act) throw new Error(`the page asked for '${data.do}', which there is not`);
        return act(data);
    }).catch(fail);
};

// ---- The engine

queue = (async () => {
    const {engine: entry, assets} = files;
    const wasmBinary = await unpacked(await bytes_of(entry, size => postMessage({is: 'engine', part: 0.9 * size / entry.bytes})), entry.path);
    engine = await makeSeldinger({
        wasmBinary,
        print: text => console.log(text),
        printErr: text => console.warn(text)
    });
    engine.progress = (part, doing) => tell({
        is: 'loading', exercise: progress_of.exercise, part: progress_of.from + (1 - progress_of.from) * part,
        doing: progress_of.doing || doing
    });
    put_assets(await unpacked(await bytes_of(assets), assets.path), assets.path);
    engine.FS.mkdirTree('/cache');
    engine.FS.mkdirTree('/attempts');
    const about = call('begin');
    about.exercises = about.exercises.filter(exercise => exercise.name in files.exercises);
    for (const exercise of about.exercises) {
        const its = files.exercises[exercise.name], megabytes = word => (files.bundles[its[word]]?.bytes ?? 0) / 1e6;
        exercise.megabytes = megabytes('');
        exercise.patients = exercise.patients.filter(({word}) => word in its).map(one => ({...one, megabytes: megabytes(one.word)}));
    }
    postMessage({is: 'ready', ...about});
})().catch(fail);
