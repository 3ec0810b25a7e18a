// The page: which screen is shown, who trains, and what passes between the engine and the screens.

import {$, el, inFolder, openDialog, say, show} from './dom.js';
import {Engine} from './engine.js';
import {Front} from './front.js';
import {Kept} from './kept.js';
import {drawMap} from './map.js';
import {EndPage, Paper, Recordings, TeacherPage} from './reading.js';
import {Room, fillHelp} from './room.js';

const screens = ['front', 'briefing', 'room', 'end', 'recordings', 'teacher', 'paper'];
const recordingWords = ({list = [], at}) => list.length > 1 ? `Recording ${at + 1} of ${list.length}` : 'A recording';
const isLearner = (name) => new TextEncoder().encode(name).length <= 64 && /^[^\p{Cc}]+$/u.test(name);

class App {
    learner = '';
    results = new Map();
    hints = true;
    openAll = false;
    screen = 'front';
    attempt = null;  // what is opened: {exercise, title, free, solution, patient, replay, list, at, for: 'demo' or 'room'}

    async begin() {
        this.kept = await new Kept().open();
        this.kept.onProblem = (problem) => this.notice(problem);
        if (this.kept.problem) this.notice(this.kept.problem);
        this.hints = await this.kept.setting('hints', true);
        this.openAll = await this.kept.setting('open-all', false);
        const last = await this.kept.setting('learner', '');
        this.engine = new Engine((message) => this.hear(message));
        this.front = new Front(this);
        this.recordings = new Recordings(this);
        this.teacher = new TeacherPage(this);
        this.paper = new Paper(this);
        this.endPage = new EndPage(this);
        this.bind();
        if (!inFolder) document.head.append(el('link', {rel: 'manifest', href: 'manifest.webmanifest'}));
        history.replaceState(null, '');
        await this.setLearner(last);
    }

    // ---- Screens

    go(screen) {
        const before = this.screen;
        this.screen = screen;
        document.body.dataset.screen = screen;
        for (const name of screens) show($(name), name === screen);
        if (screen === 'front') this.front.appear();
        else this.front.stopDemo();
        if (screen === before) return;
        scrollTo(0, 0);
        const heading = document.querySelector(`#${screen} h1[tabindex]`);
        if (heading && screen !== 'room') heading.focus({preventScroll: true});
        const {state} = history;
        if (screen === 'front' && state) history.replaceState(null, '');
        else if (screen !== 'front' && !state) history.pushState({deep: true}, '');
    }

    notice(words) {
        say($('notice'), words);
        show($('notice'), Boolean(words));
    }

    // ---- Who trains

    async setLearner(name) {
        this.learner = name;
        if (name) await this.kept.cameBack(name);
        await this.kept.setSetting('learner', name);
        this.results = await this.kept.results(name);
        $('to-learner').textContent = name || 'Guest';
        show($('who'), !name);
        this.front.draw();
    }

    /** Whether the name could be taken; else `problem` says why not. */
    async tryLearner(name, problem) {
        const typed = name.trim();
        if (typed && !isLearner(typed)) {
            problem(`Expected a name of 1 to 64 letters, found ‘${typed}’.`);
            return false;
        }
        problem('');
        await this.setLearner(typed);
        return true;
    }

    async askLearner() {
        const names = await this.kept.learners();
        $('names').replaceChildren(...names.map((name) => el('button', {type: 'button', text: name, click: async () => {
            await this.setLearner(name);
            $('learner').close();
        }})));
        $('another').value = '';
        $('learner-problem').textContent = '';
        openDialog($('learner'));
    }

    // ---- The course

    exercise(name) {
        return this.exercises?.find((one) => one.name === name);
    }
    hasPassed(name) {
        return (this.results.get(name)?.passed ?? 0) > 0;
    }
    isOpen({level}) {
        if (this.openAll || level <= 1) return true;
        const before = this.exercises.filter((one) => one.level === level - 1);
        return 3 * before.filter(({name}) => this.hasPassed(name)).length >= 2 * before.length;
    }
    nextExercise(after) {
        const from = this.exercises.findIndex(({name}) => name === after) + 1;
        return [...this.exercises.slice(from), ...this.exercises.slice(0, from)].find((one) =>
            one.level > 0 && one.name !== after && this.isOpen(one) && !this.hasPassed(one.name));
    }
    keyOf(action) {
        const found = this.keys.keys.find(({actions}) => actions.includes(action));
        return found ? found.label : 'no key';
    }

    // ---- An exercise

    /** The recording at `at` of a list of {name, bytes}; those that name no exercise of the page are passed over. */
    async watch(list, at) {
        try {
            const all = await this.engine.about(list.map(({bytes}) => bytes));
            const {error} = all[at];
            if (error) return this.notice(`${list[at].name}: ${error}`);
            this.notice('');
            const known = list.map((one, k) => ({...one, ...all[k]})).filter((one) => !one.error);
            const now = known.findIndex(({bytes}) => bytes === list[at].bytes), {exercise, patient, bytes} = known[now];
            this.open(exercise, {patient, replay: bytes, list: known, at: now});
        } catch (error) {
            this.notice(error.message);
        }
    }

    /** `how`: {free, solution, patient, replay, list, at}. */
    open(exercise, how = {}) {
        this.front.stopDemo();
        if (this.attempt) this.engine.send({do: 'close'});
        const known = this.exercise(exercise);
        this.begun({exercise, title: known?.title ?? exercise, free: false, solution: false, patient: '', replay: null, ...how, for: 'room'});
        const {attempt} = this;
        $('briefing-title').textContent = attempt.title;
        $('briefing-about').textContent = `${this.learner || 'Guest'} · ${attempt.solution ? 'The solution' : attempt.replay ? recordingWords(attempt)
            : attempt.free ? 'Free practice: no score, and the last 10 s can be taken back' : 'Exercise'}`;
        for (const id of ['indication', 'briefing-text', 'judgement', 'briefing-keys', 'briefing-doing']) $(id).textContent = '';
        $('briefing-lines').replaceChildren();
        $('briefing-hints').replaceChildren();
        $('briefing-doing').className = '';
        const {megabytes} = known?.patients?.find(({word}) => word === attempt.patient) ?? known ?? {};
        say($('briefing-doing'), megabytes && !inFolder ? `Loading the exercise, ${megabytes.toFixed(1)} MB the first time` : 'Loading the exercise');
        $('briefing-part').value = 0;
        show($('briefing-part'));
        show($('hint-more'), false);
        this.map = null;
        show($('briefing-map'), false);
        show($('briefing-picture'), Boolean(known?.picture));
        if (known?.picture) $('briefing-picture').src = known.picture;
        $('start').disabled = true;
        show($('start'), !attempt.solution && !attempt.replay);
        this.drawPatients(known);
        this.go('briefing');
    }
    begun(attempt) {
        this.attempt = attempt;
        attempt.number = this.attempts = (this.attempts ?? 0) + 1;  // of the last one the worker may still speak
        this.view = null;
        const {exercise, free, solution, patient, replay, number} = attempt;
        this.engine.send({do: 'open', attempt: number, exercise, free, solution, patient, learner: this.learner, replay});
    }

    drawPatients(exercise) {
        const others = this.attempt.solution || this.attempt.replay ? [] : exercise?.patients ?? [], best = this.results.get(exercise?.name);
        const buttons = [{word: '', who: 'the first'}, ...others].map(({word, who}) => {
            const tried = best?.patients?.[word];
            const words = `${word ? `${word}: ` : ''}${who}${tried ? ` (${tried.reached} of ${tried.attempts} reached)` : ''}`;
            return el('button', {text: words, 'aria-pressed': String(word === this.attempt.patient), click: () =>
                word !== this.attempt.patient && this.open(exercise.name, {free: this.attempt.free, patient: word})});
        });
        $('patients').replaceChildren(...others.length ? [el('span', {text: 'Patient'}), ...buttons] : []);
    }

    drawBriefing(briefing) {
        if (briefing.title) $('briefing-title').textContent = this.attempt.title = briefing.title;
        $('indication').textContent = briefing.indication ?? '';
        $('briefing-text').textContent = briefing.briefing ?? '';
        $('briefing-lines').replaceChildren(...(briefing.lines ?? []).map(([name, words]) =>
            el('div', {}, el('dt', {text: name}), el('dd', {text: words}))));
        $('judgement').textContent = this.attempt.free ? '' : briefing.judgement ?? '';
        $('briefing-keys').textContent = briefing.keys ? `Keys: ${briefing.keys.replace(/^Keys: /, '')}` : '';
        this.attempt.guided = briefing.guided;
        this.attempt.cine = /cine run/i.test(briefing.keys ?? '');
        this.map = briefing.map;
        show($('briefing-picture'), !this.map && Boolean(this.exercise(this.attempt.exercise)?.picture));
        show($('briefing-map'), Boolean(this.map));
        drawMap($('briefing-map'), this.map);
        const left = [...briefing.hints ?? []];
        show($('hint-more'), left.length > 0 && !this.attempt.solution && !this.attempt.replay);
        $('hint-more').textContent = 'A hint';
        $('hint-more').onclick = () => {
            $('briefing-hints').append(el('p', {text: left.shift()}));
            $('hint-more').textContent = 'Another hint';
            show($('hint-more'), left.length > 0);
        };
    }

    start() {
        this.go('room');
        this.room.enter(this.attempt);
        if (this.view) this.room.draw(this.view);
    }

    leave(to = 'front') {
        if (this.attempt) this.engine.send({do: 'close'});
        this.attempt = null;
        if (this.room?.isOpen) this.room.leave();
        $('review').close();
        this.engine.forgetLooks();
        this.go(to);
    }

    // ---- What the engine says

    hear(message) {
        const {is} = message, {attempt} = this;
        if (is === 'engine') $('engine-part').value = message.part;
        if (is === 'ready') this.ready(message);
        const isOld = message.attempt !== undefined && message.attempt !== attempt?.number;
        if (is === 'failed' && !isOld) return this.failed(message.error);
        if (!attempt || message.attempt !== attempt.number) return;
        if (attempt.for === 'demo') return this.front.hearDemo(message);
        if (is === 'loading') {
            $('briefing-part').value = message.part;
            if (message.doing) say($('briefing-doing'), message.doing);
        }
        if (is === 'briefing') this.drawBriefing(message);
        if (is === 'view') this.hearView(message);
        if (is === 'inside') this.room.inside.hear(message);
        if (is === 'end') this.ended(message);
    }

    hearView(view) {
        const last = this.view;
        // What was sent once holds until it is sent again.
        this.view = {...view, image: view.image ?? last?.image, reference: view.reference === undefined ? last?.reference : view.reference,
            guide: view.guide === undefined ? last?.guide : view.guide};
        if (view.phase === 'failed') return this.failed(view.error);
        if (this.screen === 'briefing' && view.phase === 'ready' && $('start').disabled) {
            $('start').disabled = false;
            show($('briefing-part'), false);
            say($('briefing-doing'), 'Ready');
            $('briefing-doing').className = 'good';
            if (this.attempt.solution || this.attempt.replay) return this.start();
            $('start').focus();
        }
        if (this.screen === 'room') this.room.draw({...view, guide: this.view.guide});
    }

    failed(error) {
        if (!this.exercises) {
            say($('engine-words'), error);
            $('engine-words').className = 'alarm';
            return show($('engine-part'), false);
        }
        if (this.attempt?.for === 'demo') return this.front.stopDemo();
        if (!this.attempt) return this.notice(error);
        if (this.room.isOpen) this.room.leave();
        say($('briefing-doing'), error);
        $('briefing-doing').className = 'alarm';
        show($('briefing-part'), false);
        show($('start'), false);
        this.go('briefing');
    }

    async ended(end) {
        const {attempt, learner, view} = this, own = !attempt.solution && !attempt.replay;
        this.room.leave();
        this.endPage.draw(end, attempt, view);
        this.go('end');
        if (!own) return;
        const tuned = view?.tuned;
        if (!attempt.free && !tuned) {
            await this.kept.addResult(learner, attempt.exercise, {...end, patient: attempt.patient,
                steps: view?.guide?.steps.filter(({done}) => done).length});
            this.results = await this.kept.results(learner);
            this.endPage.drawNext(attempt);
        }
        if (end.recording) {
            const {name, bytes} = end.recording;
            navigator.storage?.persist?.().catch(() => false);
            await this.kept.addRecording({learner, name, bytes, exercise: attempt.exercise, title: attempt.title, date: Date.now(),
                points: attempt.free ? null : end.points ?? null, passed: Boolean(end.passed), reached: Boolean(end.reached)});
            say($('end-kept'), this.kept.problem ? this.kept.problem : `Recorded: ${name}, kept in this browser.`);
        }
    }

    ready({exercises, keys, version, software}) {
        this.exercises = exercises;
        this.keys = keys;
        this.relabel();
        this.room = new Room(this);
        $('to-help').disabled = false;
        show($('engine-part'), false);
        show($('engine-words'), Boolean(software));
        say($('engine-words'), software ? 'Images are drawn without a graphics processor: WebGL 2 that adds floats is missing here, or slow.' : '');
        $('version').textContent = `Version ${version}.`;
        fillHelp(keys, (action) => this.keysOf(action));
        this.front.draw();
        this.front.appear();
        this.keepOffline();
    }
    keysOf(action) {
        return this.keys.keys.filter(({actions}) => actions.includes(action)).map(({label}) => label).join(', ') || 'no key';
    }
    /** What stands on the keys in the layout in use, where the browser says so. */
    async relabel() {
        const layout = await navigator.keyboard?.getLayoutMap?.().catch(() => null);
        if (!layout) return;
        for (const one of this.keys.keys) {
            const sign = layout.get(/^\d$/.test(one.key) ? `Digit${one.key}` : `Key${one.key}`);
            if (sign && one.key.length === 1) one.label = sign.toUpperCase();
        }
        fillHelp(this.keys, (action) => this.keysOf(action));
    }

    async keepOffline() {
        if (inFolder || !('serviceWorker' in navigator)) return;
        try {
            navigator.serviceWorker.addEventListener('message', ({data}) => {
                if (data?.is === 'updated') this.notice('A new version was loaded; it is used when the page is opened again.');
            });
            const registered = await navigator.serviceWorker.register('sw.js');
            (registered.active ?? registered.waiting ?? registered.installing)?.postMessage({do: 'update'});
        } catch {
            // Without it the page works while there is a connection.
        }
    }

    setHints(is) {
        this.hints = is;
        this.kept.setSetting('hints', is);
    }

    bind() {
        const click = (id, act) => $(id).addEventListener('click', act);
        const leaveTo = (screen) => () => this.leave(screen);
        click('home', leaveTo('front'));
        click('to-recordings', () => this.recordings.open());
        click('to-teacher', leaveTo('teacher'));
        click('to-help', () => openDialog($('help')));
        click('to-learner', () => this.askLearner());
        click('start', () => this.start());
        click('briefing-back', leaveTo('front'));
        for (const button of document.querySelectorAll('.page .back')) button.addEventListener('click', leaveTo('front'));
        for (const button of document.querySelectorAll('dialog .shut')) button.addEventListener('click', () => button.closest('dialog').close());
        $('who').addEventListener('submit', (event) => {
            event.preventDefault();
            this.tryLearner($('name').value, (words) => this.notice(words));
        });
        $('new-name').addEventListener('submit', async (event) => {
            event.preventDefault();
            if (await this.tryLearner($('another').value, (words) => $('learner-problem').textContent = words)) $('learner').close();
        });
        click('as-guest', async () => {
            await this.setLearner('');
            $('learner').close();
        });
        $('open-all').checked = this.openAll;
        $('open-all').addEventListener('change', ({target}) => {
            this.openAll = target.checked;
            this.kept.setSetting('open-all', this.openAll);
            this.front.draw();
        });
        addEventListener('resize', () => this.screen === 'briefing' && drawMap($('briefing-map'), this.map));
        addEventListener('popstate', () => {
            if (this.screen === 'front') return;
            if (this.room?.isOpen && !this.room.attempt.solution && !this.room.attempt.replay) {
                history.pushState({deep: true}, '');
                return this.room.obey('menu');
            }
            this.leave();
        });
        addEventListener('keydown', (event) => {
            const isTyped = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey;
            if (!this.keys || this.screen === 'room' || isTyped || document.querySelector('dialog[open]')) return;
            if (event.key.toLowerCase() === this.keyOf('help').toLowerCase()) openDialog($('help'));
        });
    }
}

$('to-help').disabled = true;
const app = new App();
app.begin();
