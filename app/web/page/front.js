// The front page: a demonstration that plays by itself, who trains, and the course as cards.

import {$, counted, drawGrey, el, say, show} from './dom.js';

const passMark = 70;

export class Front {
    constructor(app) {
        this.app = app;
        $('next').addEventListener('click', () => this.app.open($('next').dataset.exercise));
        this.wanted = !matchMedia('(prefers-reduced-motion: reduce)').matches && !navigator.connection?.saveData;
        $('demo-stop').addEventListener('click', () => {
            this.wanted = $('demo-stop').textContent === 'Play';
            if (this.wanted) this.#startDemo();
            else this.stopDemo();
            this.#drawStop();
        });
    }

    appear() {
        this.draw();
        clearTimeout(this.demoSoon);
        if (this.app.exercises && this.wanted) this.demoSoon = setTimeout(() => this.#startDemo(), 600);
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

    get shown() {
        return ['renal', 'straight'].map((name) => this.app.exercise(name)).find((one) => one?.solution);
    }
    /** Before it plays: the exercise's picture. */
    #drawStop() {
        show($('demo-stop'), Boolean(this.shown));
        say($('demo-stop'), this.wanted ? 'Stop' : 'Play');
        if (this.pictured || !this.shown?.picture) return;
        this.pictured = new Image();
        this.pictured.onload = () => {
            const {width, height} = $('demo');
            if (!$('demo-box').classList.contains('plays')) $('demo').getContext('2d', {alpha: false}).drawImage(this.pictured, 0, 0, width, height);
        };
        this.pictured.src = this.shown.picture;
        say($('demo-words'), this.shown.title);
    }

    #startDemo() {
        const {app, shown} = this;
        if (!shown || app.screen !== 'front' || app.attempt || document.hidden) return;
        app.begun({exercise: shown.name, free: false, solution: true, patient: '', replay: null, for: 'demo'});
        this.demo = shown;
    }
    hearDemo({is, ...message}) {
        if (is === 'view' && message.image) {
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
            this.demoSoon = setTimeout(() => this.#startDemo(), 3000);
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
