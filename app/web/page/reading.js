// Pages to read: what comes after an attempt, the recordings kept, debriefings, and a teacher's table.

import {$, counted, download, drawGrey, el, paper, say, show} from './dom.js';

const cost = (value) => value == null || value === '' ? '' : typeof value === 'string' ? value : value >= 0.5 ? `-${Math.round(value)}` : '0';

export class EndPage {
    constructor(app) {
        this.app = app;
        const click = (id, act) => $(id).addEventListener('click', act);
        const open = (how) => app.open(this.attempt.exercise, how);
        click('again', () => open({free: this.attempt.free, patient: this.attempt.patient}));
        click('next-exercise', () => app.open(this.next.name));
        click('show-me', () => open({solution: true}));
        click('others', () => app.leave());
        click('end-review', () => app.room.openReview());
        click('watch', () => open({replay: this.recording.bytes, patient: this.attempt.patient}));
        click('next-recording', () => app.watch(this.attempt.list, this.attempt.at + 1));
        click('debrief', () => app.paper.debrief(this.recording, 'end'));
        click('download', () => download(this.recording.name, this.recording.bytes));
    }

    draw(end, attempt, view) {
        this.attempt = attempt;
        this.recording = end.recording ?? null;
        const own = !attempt.solution && !attempt.replay;
        if (view?.image) drawGrey($('last-image'), view.image);
        show($('last-image'), Boolean(view?.image));
        $('end-title').textContent = end.title;
        $('end-title').className = end.tone ?? 'plain';
        $('end-about').textContent = end.subtitle ?? attempt.title;
        const lines = end.lines ?? [];
        show($('grade'), lines.length > 0);
        $('grade-own').textContent = own ? 'yours' : 'here';
        $('grade').tBodies[0].replaceChildren(...lines.map((line) => {
            const costs = cost(line.cost), isDear = costs !== '' && costs !== '0';
            return el('tr', {class: isDear ? 'costs' : ''}, el('th', {scope: 'row', text: line.name}),
                ...[line.own, line.skilled, costs].map((text) => el('td', {text: text ?? ''})));
        }));
        $('end-notes').replaceChildren(...[...(own ? [] : view?.differences ?? []), ...(end.notes ?? [])].map((text) => el('p', {text})));
        show($('formula'), Boolean(end.formula));
        $('formula').querySelector('p').textContent = end.formula ?? '';
        const events = end.events ?? [];
        show($('events-title'), own && !attempt.free || events.length > 0);
        $('events-title').textContent = attempt.solution ? 'What was done' : 'What happened';
        $('events').replaceChildren(...events.map(({time, what, where, advice, kind, run, image}) =>
            el('li', {class: kind ?? ''}, !time ? '' : run === undefined ? el('b', {text: `${time}  `})
                : el('button', {class: 'time', text: time, 'aria-label': `${time}: ${what}. Open the images of this moment`, click: () => this.app.room.openReview(run, image)}),
            el('span', {text: [what, where].filter(Boolean).join(', ')}), advice ? el('p', {text: advice}) : '')));
        show($('times-open'), events.some(({run}) => run !== undefined));
        say($('times-open'), end.timesOpen ?? '');
        say($('end-kept'), '');
        $('again').textContent = own ? 'Again' : 'Try it yourself';
        for (const id of ['watch', 'debrief', 'download']) show($(id), own && Boolean(this.recording));
        show($('end-review'), (view?.runs ?? []).length > 0);
        show($('show-me'), !attempt.solution && Boolean(this.app.exercise(attempt.exercise)?.solution));
        const {list = [], at = 0} = attempt, more = at + 1 < list.length;
        show($('next-recording'), more);
        say($('next-recording'), `Next recording (${at + 2} of ${list.length})`);
        $('next-recording').classList.toggle('first', more);
        $('again').classList.toggle('first', !more);
        this.drawNext(attempt);
    }
    drawNext(attempt) {
        this.next = attempt.solution || attempt.replay ? undefined : this.app.nextExercise(attempt.exercise);
        show($('next-exercise'), Boolean(this.next));
    }
}

/** A debriefing, and where to go back to. */
export class Paper {
    constructor(app) {
        this.app = app;
        $('paper-back').addEventListener('click', () => {
            $('paper-frame').replaceChildren();
            if (this.from === 'recordings') app.recordings.open();
            else app.go(this.from);
        });
        $('paper-save').addEventListener('click', () => download(this.name, this.html, 'text/html'));
    }
    async debrief({name, bytes}, from) {
        this.from = from;
        this.name = `${name.replace(/\.gw$/, '')}.html`;
        $('paper-frame').replaceChildren();
        $('paper-words').className = '';
        show($('paper-save'), false);
        say($('paper-words'), 'The debriefing is being made: the attempt is computed once more.');
        this.app.go('paper');
        try {
            this.html = await this.app.engine.debrief(bytes, name);
            say($('paper-words'), '');
            show($('paper-save'));
            $('paper-frame').replaceChildren(await paper(this.html, `Debriefing of ${name}`));
        } catch (error) {
            say($('paper-words'), error.message);
            $('paper-words').className = 'alarm';
        }
    }
}

export class Recordings {
    constructor(app) {
        this.app = app;
    }
    async open() {
        if (this.app.attempt) this.app.leave('recordings');
        const {kept, learner} = this.app, all = await kept.recordings(learner);
        say($('recordings-about'), kept.problem || (all.length ? `${counted(all.length, 'recording')} of ${learner || 'guests'}, kept in this browser.`
            : `No recording of ${learner || 'guests'} yet: each attempt is kept here.`));
        show($('recordings-table'), all.length > 0);
        $('recordings-table').tBodies[0].replaceChildren(...all.map((one, k) => this.#row(one, all, k)));
        this.app.go('recordings');
    }
    #row(one, all, k) {
        const {app} = this, date = new Date(one.date), when = date.toLocaleString([], {dateStyle: 'medium', timeStyle: 'short'});
        const points = one.points == null ? one.reached ? 'reached' : '–' : `${Math.round(one.points)}${one.passed ? ', passed' : ''}`;
        const button = (text, act) => el('button', {text, 'aria-label': `${text} ${one.name}`, click: act});
        const remove = button('Delete', async () => {
            // Asked for twice: it cannot be taken back.
            if (remove.textContent === 'Delete') {
                remove.textContent = 'Delete for good?';
                remove.classList.add('alarm');
                return void setTimeout(() => {
                    remove.textContent = 'Delete';
                    remove.classList.remove('alarm');
                }, 4000);
            }
            await app.kept.deleteRecording(one.id);
            await this.open();
        });
        return el('tr', {}, el('td', {}, el('time', {datetime: date.toISOString(), text: when})), el('td', {text: one.title}), el('td', {text: one.name}),
            el('td', {class: one.passed ? 'good' : '', text: points}), el('td', {class: 'row'},
                button('Watch', () => app.watch(all, k)),
                button('Debriefing', () => app.paper.debrief(one, 'recordings')),
                button('Download', () => download(one.name, one.bytes)), remove));
    }
}

/** The files of a dropped folder, with the folder that each lies in. */
async function filesOf(entry, folder = '') {
    if (entry.isFile) {
        const file = await new Promise((resolve, refuse) => entry.file(resolve, refuse));
        return [{file, folder}];
    }
    const reader = entry.createReader(), found = [];
    for (;;) {
        const some = await new Promise((resolve, refuse) => reader.readEntries(resolve, refuse));
        if (!some.length) break;
        for (const one of some) found.push(...await filesOf(one, entry.name));
    }
    return found;
}

export class TeacherPage {
    constructor(app) {
        this.app = app;
        const box = $('drop');
        const over = (is) => (event) => {
            event.preventDefault();
            box.classList.toggle('over', is);
        };
        box.addEventListener('dragover', over(true));
        box.addEventListener('dragleave', over(false));
        box.addEventListener('drop', async (event) => {
            over(false)(event);
            const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
            try {
                const found = await Promise.all(entries.map((entry) => filesOf(entry)));
                this.#read(found.flat());
            } catch (error) {
                this.#fail(`The dropped files could not be read: ${error.message}`);
            }
        });
        for (const id of ['files', 'folder'])
            $(id).addEventListener('change', ({target}) => {
                this.#read([...target.files].map((file) => ({file, folder: file.webkitRelativePath.split('/').at(-2) ?? ''})));
                target.value = '';
            });
        $('of-here').addEventListener('click', async () => this.#table((await app.kept.recordings())
            .map(({name, learner, bytes}) => ({name, learner, bytes}))));
        $('course-save').addEventListener('click', () => download('course.html', this.html, 'text/html'));
    }

    async #read(found) {
        const recordings = found.filter(({file}) => file.name.endsWith('.gw'));
        if (!recordings.length)
            return this.#fail(`Expected recordings, whose names end in .gw, found ${found.length ? counted(found.length, 'other file') : 'no file'}.`);
        say($('drop-words'), `Reading ${counted(recordings.length, 'recording')}`);
        try {
            this.#table(await Promise.all(recordings.map(async ({file, folder}) =>
                ({name: file.name, learner: folder, bytes: new Uint8Array(await file.arrayBuffer())}))));
        } catch (error) {
            this.#fail(`A recording could not be read: ${error.message}`);
        }
    }
    async #table(recordings) {
        if (!recordings.length) return this.#fail('No recording is kept in this browser yet.');
        $('drop-words').className = '';
        say($('drop-words'), `Computing ${counted(recordings.length, 'recording')} once more`);
        try {
            this.html = await this.app.engine.course(recordings);
            say($('drop-words'), counted(recordings.length, 'recording'));
            show($('course-save'));
            $('course').replaceChildren(await paper(this.html, 'Table of the course'));
            $('course-watch').querySelector('ol').replaceChildren(...recordings.map(({name, learner}, k) => el('li', {},
                el('button', {text: [learner, name].filter(Boolean).join(': '), click: () => this.app.watch(recordings, k)}))));
            show($('course-watch'));
        } catch (error) {
            this.#fail(error.message);
        }
    }
    #fail(words) {
        say($('drop-words'), words);
        $('drop-words').className = 'alarm';
    }
}
