// The front page: a demonstration that plays by itself, who trains, and the course as cards.

import {$, counted, drawGrey, el, say, show} from './dom.js';

const passMark = 70;

/** A subtraction without contrast shows nothing. */
function isEmpty({width, height, pixels}) {
    let least = 255, most = 0;
    for (let y = height >> 2; y < 3 * height >> 2; y += 5)
        for (let x = width >> 2; x < 3 * width >> 2; x += 5) {
            const grey = pixels[y * width + x];
            least = Math.min(least, grey);
            most = Math.max(most, grey);
        }
    return most - least < 60;
}

export class Front {
    constructor(app) {
        this.app = app;
        $('next').addEventListener('click', () => this.app.open($('next').dataset.exercise));
        this.wanted = !matchMedia('(prefers-reduced-motion: reduce)').matches && !navigator.connection?.saveData;
        this.played = 0;
        document.addEventListener('visibilitychange', () => {
            if (document.hidden) this.stopDemo();
            else if (app.screen === 'front') this.appear();
        });
        $('demo-stop').addEventListener('click', () => {
            this.wanted = $('demo-stop').textContent === 'Play';
            this.played = 0;
            if (this.wanted) this.#startDemo();
            else this.stopDemo();
            this.#drawStop();
        });
    }

    appear() {
        this.draw();
        clearTimeout(this.demoSoon);
        if (this.app.exercises && this.wanted) this.demoSoon = setTimeout(() => this.#startDemo());
    }

    draw() {
        const {app} = this, {exercises} = app;
        if (!exercises) return;
        const ofCourse = exercises.filter(({level}) => level > 0), passed = ofCourse.filter(({name}) => app.hasPassed(name)).length;
        say($('passed'), `${app.learner || 'Guest'}: ${passed} of ${counted(ofCourse.length, 'exercise')} passed, each with ${passMark} points or more.`);
        const next = app.nextExercise();
        show($('next'), Boolean(next));
        if (next) {
            $('next').dataset.exercise = next.name;
            say($('next'), `Next for you: ${next.title}`);
        }
        const levels = [...new Set(exercises.map(({level}) => level))].sort((a, b) => (a || 99) - (b || 99)), most = Math.max(...levels);
        this.#drawStop();
        $('cards').replaceChildren(...levels.map((level) => el('section', {},
            el('h2', {text: level > 0 ? `Level ${level} of ${most}` : 'Exercises of your own'}),
            el('div', {class: 'cards'}, ...exercises.filter((one) => one.level === level).map((one) => this.#card(one))))));
    }

    #reached({name, guided}) {
        const best = this.app.results.get(name);
        if (!best) return ['not tried yet', 'faint'];
        const tone = best.passed > 0 ? 'good' : 'caution', passed = best.passed > 0 ? 'passed: ' : '';
        if (guided) return [`${passed}${counted(best.steps, 'step')} done`, tone];
        if (!best.reached) return [`tried ${best.attempts === 1 ? 'once' : `${best.attempts} times`}, not reached yet`, tone];
        return [`${passed}best ${Math.round(best.points)} points${best.time == null ? '' : `, ${best.time.toFixed(1)} s`}, ${best.reached} of ${best.attempts} reached`, tone];
    }

    #card(exercise) {
        const {app} = this, isOpen = app.isOpen(exercise), others = Object.keys(app.results.get(exercise.name)?.patients ?? {}).length;
        const [words, tone] = isOpen ? this.#reached(exercise) : [`Opens when two thirds of level ${exercise.level - 1} are passed`, 'faint'];
        const button = (text, how, name) => el('button', {text, class: name, 'aria-label': `${text}: ${exercise.title}`, click: () => app.open(exercise.name, how)});
        return el('article', {class: isOpen ? 'card' : 'card closed', 'data-exercise': exercise.name},
            exercise.picture ? el('img', {src: exercise.picture, alt: '', loading: 'lazy', width: 256, height: 256}) : el('div', {class: 'no-picture'}),
            el('div', {class: 'about'},
                el('h3', {text: exercise.title}),
                exercise.summary ? el('p', {text: exercise.summary}) : '',
                el('p', {class: `${tone} reached`, text: words}),
                others && isOpen ? el('p', {class: 'faint', text: `${counted(others, 'other patient')} tried`}) : '',
                el('div', {class: 'row'},
                    isOpen ? button('Exercise', {}, 'first') : '',
                    button('Free practice', {free: true}, 'free'),
                    exercise.solution ? button('Show me', {solution: true}, 'show') : '')));
    }

    // ---- The demonstration

    /** The smaller patient first; the picture of that exercise is in index.html. */
    get shown() {
        const all = ['cerebral', 'renal'].map((name) => this.app.exercise(name)).filter((one) => one?.solution);
        return all[this.played % all.length];
    }
    /** Before it plays, the exercise's picture is there, from index.html. */
    #drawStop() {
        show($('demo-stop'), Boolean(this.shown));
        say($('demo-stop'), this.wanted ? 'Stop' : 'Play');
        if (this.shown && !$('demo-box').classList.contains('plays')) say($('demo-words'), this.shown.title);
    }

    #startDemo() {
        const {app, shown} = this;
        if (!shown || app.screen !== 'front' || app.attempt || document.hidden) return;
        app.begun({exercise: shown.name, free: false, solution: true, patient: '', replay: null, for: 'demo'});
        this.demo = shown;
    }
    hearDemo({is, ...message}) {
        if (is === 'view' && message.image && !isEmpty(message.image)) {
            drawGrey($('demo'), message.image);
            $('demo-box').classList.add('plays');
            say($('demo-words'), `The solution of ‘${this.demo.title}’, four times as fast`);
        }
        if (is === 'view' && message.phase === 'ready' && !this.demoRuns) {
            this.demoRuns = true;
            this.app.engine.send({do: 'speed', factor: 4});
            this.app.engine.send({do: 'start'});
        }
        if (is === 'view' && message.phase === 'failed') this.stopDemo();
        if (is === 'end') {
            this.stopDemo();
            // Each once: it costs as much as training does.
            if (++this.played < 2) this.demoSoon = setTimeout(() => this.#startDemo(), 2000);
            else this.wanted = false;
            this.#drawStop();
        }
    }
    stopDemo() {
        clearTimeout(this.demoSoon);
        this.demoRuns = false;
        if (this.app.attempt?.for !== 'demo') return;
        this.app.attempt = null;
        this.app.engine.send({do: 'close'});
    }
}
