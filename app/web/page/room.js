// The room: live image with its marks, reference, runs, readouts, strip, lesson, hints, pause, menu and buttons.

import {$, el, say, show, drawGrey, openDialog} from './dom.js';
import {Hands, bindAction, bindImage, bindPad, keyName} from './input.js';
import {Inside} from './inside.js';
import {Panel, centimetresIn} from './panel.js';
import {Review} from './review.js';

const seldom = ['instructor', 'menu', 'help', 'review', 'pause'];

// Each is shown until it was done once: with keys, and for thumbs. {0} is the action's key, {1} that of the first
// injection by the pump.
const hints = [
    ['fluoroscopy', 'Hold {0} for fluoroscopy: the image is live while the pedal is down', ['fluoroscopy'],
        'Hold Fluoroscopy: the image is live while the pedal is down'],
    ['advance', '{0} pushes the wire, the mouse wheel as well; Shift is slower, Ctrl faster', ['advance'],
        'The pad pushes the wire: up from where the thumb lies; the farther, the faster'],
    ['rotate_right', '{0} turns the wire: look for the side that its tip points to', ['rotate_right', 'rotate_left'],
        'Sideways, the pad turns the wire: look for the side that its tip points to'],
    ['left_advance', '{0} pushes what the left hand holds, at the same time: the strip below says what', ['left_advance', 'left_withdraw'],
        'The button below the pad gives it the other hand, which holds the catheter'],
    ['acquisition', 'Hold {0} for a DSA run, and inject with {1} once its mask is taken', ['inject'],
        'Hold Run for a DSA run, and inject with {1} once its mask is taken'],
    ['roadmap', '{0} lays the vessels of the last DSA run under the live image', ['roadmap'],
        'Roadmap lays the vessels of the last DSA run under the live image']
];

export class Room {
    /** `app`: {engine, keys, hints, setHints(is), leave(), ended()}. */
    constructor(app) {
        this.app = app;
        this.engine = app.engine;
        this.hands = new Hands(app.keys, (action) => this.obey(action), () => this.handsFree());
        this.panel = new Panel($('column'), (axis, by) => this.hands.add(axis, by));
        this.review = new Review(this.engine);
        this.inside = new Inside();
        this.view = null;
        this.#bind();
        this.#makeButtons();
    }

    // ---- An attempt

    /** `attempt`: {title, free, solution, replay}. */
    enter(attempt) {
        Object.assign(this, {attempt, view: null, asking: null, sides: null, isOpen: true, counting: 0, wasCount: null});
        this.thumbs = new Map();
        this.hands.letGo();
        this.hands.last = '';
        this.hands.used.clear();
        this.review.reset();
        this.inside.close();
        $('room-title').textContent = attempt.title;
        $('mark-title').textContent = attempt.title;
        for (const id of ['messages', 'runs']) $(id).replaceChildren();
        this.said = new Map();
        this.#forgetImage($('image'));
        this.#forgetImage($('reference').querySelector('canvas'));
        show($('sheet'), false);
        const watched = attempt.solution || attempt.replay;
        show($('speed').parentElement, Boolean(watched));
        if (!attempt.list) $('speed').value = '1';
        if (watched) this.engine.send({do: 'speed', factor: Number($('speed').value)});
        $('room').classList.toggle('watched', Boolean(watched));
        $('image').focus({preventScroll: true});
        requestAnimationFrame(() => this.#frame());
        if (watched || attempt.free) return this.engine.send({do: 'start'});
        this.counting = performance.now() + 3000;
    }

    leave() {
        this.isOpen = false;
        this.hands.letGo();
        for (const id of ['menu', 'help', 'asking']) $(id).close();
        this.engine.forgetLooks();
    }

    /** What is done at each image of the screen. */
    #frame() {
        if (!this.isOpen) return;
        if (this.counting) this.#countDown();
        const input = this.hands.take();
        if (input) this.engine.send(input);
        requestAnimationFrame(() => this.#frame());
    }

    /** Begins again after a dialog. */
    #countDown() {
        if (document.querySelector('dialog[open]')) this.counting = performance.now() + 3000;
        const left = (this.counting - performance.now()) / 1000;
        show($('countdown'), left > 0);
        if (left <= 0) {
            this.counting = 0;
            this.engine.send({do: 'start'});
            return;
        }
        say($('countdown').querySelector('strong'), String(Math.ceil(left)));
        $('countdown').querySelector('circle').style.strokeDashoffset = String(264 * (1 - left % 1));
    }

    /** What was asked for holds at once, not only from the next view on. */
    #control(what) {
        this.engine.send({do: what});
        if (this.view) this.view.phase = what === 'pause' ? 'paused' : 'running';
    }
    get running() {
        return this.view?.phase === 'running';
    }
    handsFree() {
        return this.isOpen && this.running && !this.counting && !document.querySelector('dialog[open]') &&
            !this.attempt.solution && !this.attempt.replay;
    }

    // ---- The page's own actions

    obey(action) {
        if (!this.isOpen || this.counting && action !== 'menu') return;
        if (action !== 'finish' && action !== 'back_to_start') this.engine.send({do: 'keyPressed', action});
        const {phase} = this.view ?? {};
        if (action === 'help') this.#openPaused($('help'));
        if (action === 'menu') this.#openPaused($('menu'));
        if (action === 'review') this.openReview();
        if (action === 'pause' && (phase === 'running' || phase === 'paused'))
            this.#control(phase === 'running' ? 'pause' : 'resume');
        if (action === 'instructor') this.#lookInside(!this.inside.isOpen);
        if (action === 'skip') this.engine.send({do: 'skipStep'});
        if (action === 'take_back') this.engine.send({do: 'takeBack'});
        if (action === 'finish' || action === 'back_to_start') this.#ask(action);
    }

    /** A dialog stops the exercise, and where it ran it goes on afterwards. */
    #openPaused(dialog) {
        if (document.querySelector('dialog[open]')) return;
        this.goesOn = this.running;
        if (this.running) this.#control('pause');
        this.hands.letGo();
        $('menu-hints').checked = this.app.hints;
        openDialog(dialog);
    }
    #dialogClosed() {
        if (!this.isOpen || document.querySelector('dialog[open]')) return;
        if (this.goesOn) this.#control('resume');
        this.goesOn = false;
        $('image').focus({preventScroll: true});
    }

    openReview(run, image) {
        this.hands.letGo();
        this.review.open(this.view?.runs ?? [], run, image);
    }
    #lookInside(is) {
        if (is) this.inside.open();
        else this.inside.close();
        this.engine.send({do: 'inside', is});
    }

    #ask(action) {
        const {phase, recording} = this.view ?? {};
        if (phase !== 'running' && phase !== 'paused') return;
        if (this.attempt.solution || this.attempt.replay) {
            if (action === 'finish') this.engine.send({do: 'finish'});
            return;
        }
        const again = action === 'back_to_start';
        this.asking = action;
        $('asking-title').textContent = again ? 'Start again?' : 'End the exercise?';
        $('asking-words').textContent = (again ? 'This attempt ends and a new one begins.' : 'This attempt ends here.') +
            (recording ? ' What was done stays in the recording.' : '');
        this.#openPaused($('asking'));
        if ($('asking').open) $('yes').focus();
    }
    #answerYes() {
        if (this.asking === 'finish') {
            this.goesOn = false;
            this.engine.send({do: 'finish'});
        } else {
            this.goesOn = true;
            this.engine.send({do: 'input', held: [], pressed: ['back_to_start'], injections: [], wheel: 0, dragUp: 0, dragRight: 0,
                push: [0, 0], turn: [0, 0], armLao: 0, armCranial: 0, tableLeft: 0, tableHead: 0});
            this.hands.last = '';
        }
        $('asking').close();
    }

    // ---- What the engine says

    draw(view) {
        const before = this.view?.phase;
        this.view = view;
        if (!this.isOpen || view.phase === 'loading' || view.phase === 'failed') return;
        if (view.image) {
            drawGrey($('image'), view.image);
            $('picture').classList.add('has-image');
        }
        const reference = $('reference');
        if (view.reference) drawGrey(reference.querySelector('canvas'), view.reference);
        if (view.reference !== undefined) reference.classList.toggle('stored', view.reference !== null);
        const {readout} = view;
        if (readout) {
            this.#drawMarks(view);
            this.panel.draw(readout, readout.marks);
            this.#drawMessages(readout.messages ?? []);
            for (const part of [$('balloon-tools'), ...document.querySelectorAll('.of-balloon')]) show(part, Boolean(readout.balloon));
            const two = (readout.devices?.length ?? 1) > 1;
            $('pad-hand').disabled = !two;
            say($('pad-hand'), `${this.hands.side ? 'Left' : 'Right'} hand: ${(this.hands.side ? readout.leftHand : readout.held) || (two ? '-' : 'wire')}`);
        }
        this.#drawStrip(view);
        this.#drawRuns(view.runs ?? []);
        this.#drawGuide(view);
        this.#drawHint(view);
        show($('caption'), Boolean(view.caption));
        say($('caption'), view.caption ?? '');
        const paused = view.phase === 'paused' && !document.querySelector('dialog[open]');
        show($('paused'), paused);
        say($('paused').querySelector('strong'), view.teacherPaused ? 'THE TEACHER HAS PAUSED' : 'PAUSED');
        show($('go-on'), !view.teacherPaused);
        if (before === 'running' && view.phase !== 'running') this.hands.letGo();
        this.review.runsAre(view.runs ?? []);
    }

    #drawMarks({readout, strip}) {
        const marks = readout.marks ?? {}, sides = readout.sides ?? {};
        const stand = ['SID', 'FD'].map((name) => [name, centimetresIn(readout.groups, name)])
            .filter(([, length]) => length !== null).map(([name, length]) => `${name} ${length} cm`).join('   ');
        const texts = {
            'mark-mode': marks.mode ?? readout.mode, 'mark-mask': marks.mask ?? '', 'mark-angles': marks.angles ?? '',
            'mark-frame': marks.frame == null ? '' : `image ${marks.frame}`, 'mark-time': strip?.time ?? '',
            'side-left': sides.left ?? '', 'side-right': sides.right ?? '', 'side-top': sides.top ?? '', 'mark-stand': stand,
            'mark-breath': readout.breathHeld == null ? '' : `breath held ${Math.floor(readout.breathHeld)} s`
        };
        for (const id in texts) say($(id), texts[id] ?? '');
        $('mark-live').classList.toggle('on', readout.beamOn);
        say($('mark-live').querySelector('span'), readout.beamOn ? 'LIVE' : 'LIH');
    }

    /** What stays is left alone, so that a screen reader says what is new. */
    #drawMessages(messages) {
        const now = new Set(messages.map(({text}) => text));
        for (const [text, line] of this.said)
            if (!now.has(text)) {
                line.remove();
                this.said.delete(text);
            }
        for (const {text, notice} of messages) {
            const line = this.said.get(text) ?? el('p', {text});
            line.className = notice;
            if (this.said.has(text)) continue;
            this.said.set(text, line);
            $('messages').append(line);
        }
    }

    #drawStrip({strip = {}, readout, phase, slow, recording, teacherPaused, takenBack, differences}) {
        const {free, solution, replay} = this.attempt, items = [];
        const item = (name, value, tone = '') => items.push([name, value, tone]);
        item('TIME', strip.time);
        item('BEAM', strip.beam, readout?.beamOn ? 'beam' : '');
        item('DOSE', strip.dose);
        item('CONTRAST', strip.contrast, strip.contrastLow ? 'caution' : '');
        item('ERRORS', String(strip.errors ?? 0), strip.errors ? 'caution' : '');
        if ((readout?.devices?.length ?? 0) > 1 && !solution && !replay) {
            item('LEFT', readout.leftHand || '-');
            item('RIGHT', readout.held || '-');
            item('HELPER', readout.helper || '-');
        }
        if (free) item('FREE PRACTICE', `${takenBack ?? 0} taken back`, 'calm');
        if (solution) item('SOLUTION', 'your turn comes next', 'calm');
        if (replay) item('REPLAY', differences?.length ? 'differs' : 'as recorded', differences?.length ? 'alarm' : 'calm');
        if (phase === 'paused')
            item('PAUSED', teacherPaused ? 'the teacher lets you go on' : this.asking && $('asking').open ? 'answer first' : `${this.key('pause')} goes on`, 'caution');
        if (readout?.injecting > 0) item('INJECTING', `${readout.injecting.toFixed(1)} ml/s`, 'caution');
        if (slow) item('SLOW', 'frames are late', 'alarm');
        if (recording) item('', 'REC', 'good rec');
        else if (!solution && !replay && phase === 'running') item('', 'NOT RECORDED', 'alarm rec');
        const words = JSON.stringify(items);
        if (words === this.stripWords) return;
        this.stripWords = words;
        const list = $('strip').querySelector('dl');
        while (list.children.length > items.length) list.lastChild.remove();
        while (list.children.length < items.length) list.append(el('div', {}, el('dt'), el('dd')));
        items.forEach(([name, value, tone], k) => {
            const box = list.children[k];
            box.className = tone;
            say(box.firstChild, name);
            say(box.lastChild, value ?? '');
        });
    }

    /** The last run first; their pictures are asked for once, and again when the run has grown to its end. */
    #drawRuns(runs) {
        const words = JSON.stringify(runs);
        if (words !== this.runWords) {
            this.runWords = words;
            this.runsSince = performance.now();
            const shown = runs.slice(-12).reverse();
            $('runs').replaceChildren(...shown.map((run) => {
                const kept = this.thumbs.get(run.number) ?? {canvas: el('canvas', {width: 64, height: 64}), images: 0};
                this.thumbs.set(run.number, kept);
                const button = el('button', {class: 'run', 'aria-label': `Look at run ${run.number}, ${run.mode}, ${run.images} images`,
                    click: () => this.openReview(run.number)}, kept.canvas, el('span', {text: `${run.number} ${run.mode}  ${run.images}`}));
                return button;
            }));
        }
        if (this.looking) return;
        const ended = performance.now() - this.runsSince > 700;
        const run = runs.find(({number, images}) => {
            const kept = this.thumbs.get(number);
            return kept && kept.images !== images && (ended ? images > 0 : !kept.images && images > 2);
        });
        if (!run) return;
        this.looking = true;
        const kept = this.thumbs.get(run.number);
        this.engine.look({run: run.number, image: run.images - 1}).then((picture) => {
            drawGrey(kept.canvas, picture);
            kept.images = run.images;
        }, () => kept.images = run.images).finally(() => this.looking = false);
    }

    #drawGuide({guide, phase}) {
        const box = $('guide'), isShown = Boolean(guide) && !this.counting && (phase === 'running' || phase === 'paused');
        show(box, isShown);
        if (!isShown) return;
        const {steps} = guide, words = JSON.stringify(guide);
        if (words === this.guideWords) return;
        this.guideWords = words;
        const done = steps.filter((step) => step.done).length, skipped = steps.filter((step) => step.skipped).length;
        const now = steps[guide.step], over = !now;
        say($('guide-task'), over ? 'All steps' : now.title ?? '');
        say($('guide-count'), `${done} of ${steps.length}${skipped ? `, ${skipped} left out` : ''}`);
        $('guide-part').value = done / steps.length;
        show($('guide-skip'), !over);
        say($('guide-skip'), `Leave out (${this.key('skip')})`);
        say($('guide-text'), over ? 'Now bring the tip to the target and hold it there.' : now.text);
        $('guide-practices').replaceChildren(...(now?.practices ?? []).map(({text, keys, done: isDone}) =>
            el('li', {class: isDone ? 'done' : ''}, el('span', {class: 'tick', role: 'img', text: isDone ? '✓' : '', 'aria-label': isDone ? 'done' : 'to do'}),
                el('span', {text}), el('b', {text: keys ?? ''}))));
    }

    #drawHint({phase, readout}) {
        const {used} = this.hands, {cine, solution, replay} = this.attempt;
        const next = hints.find(([action, , doneBy]) => !doneBy.some((name) => used.has(name)) &&
            !(action === 'left_advance' && (readout?.devices?.length ?? 1) < 2) && !(action === 'roadmap' && cine));
        const isShown = this.app.hints && phase === 'running' && !this.view.guide && !solution && !replay && Boolean(next);
        show($('hint'), isShown);
        if (!isShown) return;
        const pump = this.app.keys.injections.find(({text}) => /pump/i.test(text)), byThumb = getComputedStyle($('pad')).display !== 'none';
        let words = next[byThumb ? 3 : 1];
        if (cine && next[0] === 'acquisition') words = words.replace('DSA', 'cine').replace(' once its mask is taken', '');
        say($('hint').querySelector('p'), words.replace('{0}', this.key(next[0])).replace('{1}', pump?.key ?? 'no key'));
    }

    key(action) {
        return this.app.keyOf(action);
    }

    // ---- Buttons and what is bound to them

    button(action, words) {
        const info = this.hands.actions.get(action), button = el('button', {'data-action': action, text: words ?? info?.title ?? action});
        if (info) {
            const how = info.held ? `${info.title} (hold${info.task === 'Pedals' ? ', or click to keep it down' : ''})` : info.title;
            button.title = `${how}: ${this.key(action)}`;
        }
        bindAction(button, this.hands, action);
        return button;
    }
    injection({text, key}, number, words) {
        return el('button', {'data-injection': number, title: `${text}: ${key}`, text: words, 'aria-label': `Inject ${text}`, click: (event) => {
            this.hands.inject(number);
            if (event.detail) event.currentTarget.blur();
        }});
    }

    #makeButtons() {
        const {keys} = this.app, group = (title, ...buttons) =>
            el('div', {class: 'tool-group', role: 'group', 'aria-label': title}, el('span', {text: title}), el('div', {}, ...buttons));
        const injections = () => keys.injections.map((one, k) => {
            const button = this.injection(one, k, one.key), volume = /[\d.]+ ml/.exec(one.text);
            if (volume) button.append(el('small', {text: volume[0]}));
            return button;
        });
        const large = (name, box) => {
            box.classList.add('large-only', name);
            return box;
        };
        const hand = (title, prefix) => large('hands', group(title, ...[['advance', '↑'], ['withdraw', '↓'], ['rotate_left', '↺'], ['rotate_right', '↻']].map(([name, sign]) => {
            const button = this.button(prefix + name, sign);
            button.setAttribute('aria-label', this.hands.actions.get(prefix + name)?.title ?? name);
            return button;
        })));
        const pedals = () => [this.button('fluoroscopy', 'Fluoroscopy'), this.button('acquisition', 'Run')];
        const {actions} = this.hands;
        const some = ['roadmap', 'reference', 'mask', 'device', 'acquisition_mode'].filter((name) => actions.has(name));
        const short = {roadmap: 'Roadmap', reference: 'Reference', mask: 'Mask', device: 'Device', acquisition_mode: 'DSA/cine'};
        const balloon = group('Balloon', ...[['inflate', '+1 atm'], ['deflate', 'Deflate'], ['deploy', 'Stent'], ['next_balloon', 'Next']]
            .filter(([name]) => actions.has(name)).map(([name, words]) => this.button(name, words)));
        balloon.id = 'balloon-tools';
        balloon.hidden = true;
        const inject = group('Inject', ...injections());
        if (keys.injections.length === 5) inject.classList.add('fives');
        $('tools').append(large('pedal-tools', group('Pedals', ...pedals())), group('Image', ...some.map((name) => this.button(name, short[name]))), inject, balloon, hand('Right', ''), hand('Left', 'left_'),
            large('fours', group('C-arm', ...[['arm_rao', 'RAO'], ['arm_lao', 'LAO'], ['arm_cranial', 'CRAN'], ['arm_caudal', 'CAUD']].map(([name, words]) => this.button(name, words)))),
            group('Room', el('button', {id: 'open-sheet', text: 'All', 'aria-label': 'All actions', click: () => this.openSheet()}), el('button', {id: 'open-column', class: 'small-only', text: 'Readouts',
                'aria-expanded': 'false', click: () => this.#toggleColumn()}), this.button('instructor', 'Patient'), this.button('review', 'Runs'), this.button('pause', 'Pause')));
        const inside = document.querySelector('#tools [data-action=instructor]'), words = `View into the patient (${this.key('instructor')})`;
        Object.assign(inside, {id: 'open-inside', title: words, ariaPressed: 'false'}).setAttribute('aria-label', words);
        say($('menu-inside'), words);
        $('pedals').append(...pedals());
        $('strip').append(el('dl'), el('label', {}, el('span', {text: 'Speed'}), el('select', {id: 'speed', change: ({target}) =>
            this.engine.send({do: 'speed', factor: Number(target.value)})}, ...[1, 2, 4, 8].map((factor) => el('option', {value: factor, text: `${factor} ×`})))),
        this.button('help', `${this.key('help')} keys`), this.button('menu', `${this.key('menu')} menu`));
        const tasks = [...new Set(keys.actions.map(({task}) => task))];
        const isOfBalloon = (task) => /balloon/i.test(task);
        const all = tasks.map((task) => {
            const mine = keys.actions.filter((action) => action.task === task && !seldom.includes(action.name));
            const buttons = mine.map(({name, title}) => {
                const button = this.button(name, title);
                button.append(el('kbd', {text: this.key(name)}));
                return button;
            });
            if (/contrast/i.test(task)) buttons.push(...this.#injectionList());
            return el('div', isOfBalloon(task) ? {class: 'of-balloon'} : {}, el('h2', {text: task}), el('div', {class: 'sheet-buttons'}, ...buttons));
        });
        if (!tasks.some((task) => /contrast/i.test(task)))
            all.splice(Math.min(3, all.length), 0, el('div', {}, el('h2', {text: 'Contrast'}), el('div', {class: 'sheet-buttons'}, ...this.#injectionList())));
        $('sheet').lastElementChild.replaceChildren(...all);
        this.hands.onHold = () => {
            const held = this.hands.held();
            for (const button of document.querySelectorAll('#room [data-action]'))
                if (this.hands.actions.get(button.dataset.action)?.held)
                    button.setAttribute('aria-pressed', String(held.has(button.dataset.action)));
        };
    }
    #injectionList() {
        return this.app.keys.injections.map((one, k) => {
            const button = this.injection(one, k, one.text);
            button.append(el('kbd', {text: one.key}));
            return button;
        });
    }

    openSheet() {
        show($('sheet'), $('sheet').hidden);
        if (!$('sheet').hidden) $('sheet-close').focus();
    }
    #toggleColumn() {
        const isOpen = $('room').classList.toggle('column-open');
        $('open-column').setAttribute('aria-expanded', String(isOpen));
        if (this.view?.readout) this.panel.draw(this.view.readout, this.view.readout.marks);
    }

    #forgetImage(canvas) {
        canvas.getContext('2d', {alpha: false}).clearRect(0, 0, canvas.width, canvas.height);
        $('picture').classList.remove('has-image');
        $('reference').classList.remove('stored');
        say($('reference').querySelector('p'), `${this.key('reference')} stores the image here`);
    }

    #bind() {
        bindImage($('image'), this.hands, () => {
            const {groups} = this.view?.readout ?? {}, of = (name, otherwise) => 10 * (centimetresIn(groups, name) ?? otherwise);
            return of('FD', 30) * of('SOD', 75) / of('SID', 110) / $('image').clientWidth;
        });
        bindPad($('pad-area'), this.hands);
        $('pad-hand').addEventListener('click', () => {
            this.hands.pad(0, 0);
            this.hands.side = 1 - this.hands.side;
            $('pad-hand').setAttribute('aria-pressed', String(Boolean(this.hands.side)));
            if (this.view) this.draw({...this.view, image: undefined, reference: undefined});
        });
        addEventListener('keydown', (event) => this.#keyDown(event));
        addEventListener('keyup', ({code}) => this.hands.keyUp(keyName(code)));
        addEventListener('blur', () => this.hands.letGo());
        document.addEventListener('visibilitychange', () => {
            if (!document.hidden || !this.isOpen) return;
            this.hands.letGo();
            if (this.counting) this.#openPaused($('menu'));
            else if (this.running) this.#control('pause');
        });
        addEventListener('beforeunload', (event) => {
            if (this.isOpen && this.running && !this.attempt.solution && !this.attempt.replay) event.preventDefault();
        });
        for (const id of ['menu', 'help', 'asking', 'review']) $(id).addEventListener('close', () => this.#dialogClosed());
        const click = (id, act) => $(id).addEventListener('click', act);
        click('go-on', () => this.obey('pause'));
        click('guide-skip', () => this.obey('skip'));
        click('hint-none', () => {
            this.app.setHints(false);
            show($('hint'), false);
        });
        click('sheet-close', () => {
            show($('sheet'), false);
            $('image').focus({preventScroll: true});
        });
        click('yes', () => this.#answerYes());
        click('no', () => $('asking').close());
        click('menu-go-on', () => $('menu').close());
        click('menu-help', () => this.#instead(() => openDialog($('help'))));
        click('menu-actions', () => {
            $('menu').close();
            show($('sheet'), false);
            this.openSheet();
        });
        click('menu-review', () => this.#instead(() => this.openReview()));
        click('menu-inside', () => {
            $('menu').close();
            this.obey('instructor');
        });
        click('inside-close', () => {
            this.#lookInside(false);
            $('image').focus({preventScroll: true});
        });
        click('menu-full', () => this.#fullScreen());
        $('menu-hints').addEventListener('change', ({target}) => this.app.setHints(target.checked));
        click('menu-finish', () => {
            this.goesOn = false;
            this.engine.send({do: 'finish'});
            $('menu').close();
        });
        click('menu-leave', () => {
            this.goesOn = false;
            this.app.leave();
        });
    }
    /** One dialog after another, without the exercise going on between. */
    #instead(open) {
        const {goesOn} = this;
        this.goesOn = false;
        $('menu').close();
        open();
        setTimeout(() => this.goesOn = goesOn);
    }

    /** In full screen the browser's own keys, as Ctrl and W, come to the room where the browser can do that. */
    async #fullScreen() {
        try {
            if (document.fullscreenElement) await document.exitFullscreen();
            else {
                await document.documentElement.requestFullscreen();
                await navigator.keyboard?.lock?.();
            }
        } catch {
            // Some browsers have no full screen.
        }
        $('menu').close();
    }

    #keyDown(event) {
        if (!this.isOpen || event.metaKey || event.altKey && !event.code.startsWith('Alt')) return;
        if (document.querySelector('dialog[open]')) {
            if (event.code === 'F5' || !$('review').open && !$('help').open) return;
            const name = keyName(event.code), actions = this.hands.byKey.get(name) ?? [];
            if ($('review').open && actions.includes('review') && event.target.tagName !== 'SELECT') $('review').close();
            if ($('help').open && actions.includes('help')) $('help').close();
            return;
        }
        const at = document.activeElement, onButton = at && at !== document.body && at !== $('image') && at.closest('#room');
        if (at?.tagName === 'SELECT' && event.code !== 'Escape') return;
        if (event.code === 'Tab' && (event.shiftKey || onButton)) return;
        if (event.code === 'Escape' && (onButton || !$('sheet').hidden)) {
            event.preventDefault();
            show($('sheet'), false);
            return $('image').focus({preventScroll: true});
        }
        if (this.hands.keyDown(keyName(event.code), event.repeat)) event.preventDefault();
    }
}

/** The keys, by what they are for. */
export function fillHelp(keys, keysOf) {
    const tasks = [...new Set([...keys.actions.map(({task}) => task)])];
    const list = (rows) => el('dl', {class: 'keys'}, ...rows.map(([key, words]) => el('div', {}, el('dt', {}, el('kbd', {text: key})), el('dd', {text: words}))));
    const contrast = () => list(keys.injections.map(({key, text}) => [key, text]));
    const parts = tasks.map((task) => {
        const rows = keys.actions.filter((action) => action.task === task)
            .map(({name, title, held}) => [keysOf(name), name === 'instructor' ? 'view into the patient' : title + (held ? ' (hold)' : '')]);
        const part = el('section', {}, el('h3', {text: task}), list(rows));
        const add = (words) => part.append(el('p', {class: 'faint', text: words}));
        if (/hand/i.test(task)) add('Mouse: the wheel pushes; a drag on the image pushes up and turns sideways. Gamepad: left stick, right stick. A click on a pedal’s button keeps it down until the next one.');
        if (/c-arm|table|stand/i.test(task)) add('Mouse: dragging the C-arm’s pictograms turns it; the right button on the image, or two fingers, move the table.');
        if (/balloon/i.test(task)) add('In exercises that have one. Sheath and handle follow at their own speed; the panel shows how far they are.');
        if (/exercise/i.test(task)) add('Shift and Tab go to the buttons of the room; Escape comes back to the image.');
        return part;
    });
    if (keys.injections.length)
        parts.splice(3, 0, el('section', {}, el('h3', {text: 'Contrast'}), contrast(), el('p', {class: 'faint', text: 'One injection at a time; how much was given stands in the strip below.'})));
    document.getElementById('help-list').replaceChildren(...parts);
}
