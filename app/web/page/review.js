// The runs taken: cine loop, mask, shift, window and level; and a zoom, which the page does itself.

import {$, drawGrey, el, openDialog, show} from './dom.js';

const rate = 7.5;  // images a second of the loop; the engine does not say how fast a run was taken

export class Review {
    constructor(engine) {
        this.engine = engine;
        this.canvas = $('review-picture');
        this.inputs = Object.fromEntries(['image', 'x', 'y', 'window', 'level', 'zoom'].map((name) => [name, $(`review-${name}`)]));
        this.reset();
        for (const [name, input] of Object.entries(this.inputs))
            input.addEventListener('input', () => {
                if (name === 'image') this.#stop();
                this.#show();
            });
        $('review-run').addEventListener('change', ({target}) => this.#choose(Number(target.value)));
        $('review-play').addEventListener('click', () => {
            this.plays = !this.plays;
            this.#show();
        });
        $('review-before').addEventListener('click', () => this.#step(-1));
        $('review-after').addEventListener('click', () => this.#step(1));
        $('review-mask').addEventListener('click', () => {
            this.mask = Number(this.inputs.image.value) - 1;
            this.#show();
        });
        this.#bindDrag();
    }

    reset() {
        Object.assign(this, {runs: [], run: null, mask: 0, plays: true, left: 0, top: 0, shown: ''});
        for (const [name, value] of Object.entries({x: 0, y: 0, window: 256, level: 128, zoom: 1})) this.inputs[name].value = value;
    }

    open(runs, number) {
        this.runsAre(runs, true);
        if (runs.length) this.#choose(number ?? this.run?.number ?? runs.at(-1).number);
        openDialog($('review'));
        $('review-play').focus();
        clearInterval(this.timer);
        this.timer = setInterval(() => {
            if (!$('review').open) return clearInterval(this.timer);
            if (this.plays && this.run?.images > 1 && !this.asking) this.#step(1, true);
        }, 1000 / rate);
    }

    runsAre(runs, always = false) {
        const words = JSON.stringify(runs);
        if (!always && (!$('review').open || words === this.words)) return;
        this.words = words;
        this.runs = runs;
        $('review-run').replaceChildren(...runs.map(({number, mode, images}) => el('option', {value: number, text: `${number}  ${mode}  ${images} images`})));
        show($('review-none'), !runs.length);
        show($('review-controls'), runs.length > 0);
        show($('review-stage'), runs.length > 0);
        if (!runs.length) return;
        if (this.run) this.#choose(this.run.number);
        else if (!always) this.#choose(runs.at(-1).number);
    }

    #choose(number) {
        const run = this.runs.find((one) => one.number === number) ?? this.runs.at(-1);
        if (run.number !== this.run?.number) {
            this.mask = 0;
            this.inputs.image.value = 1;
        }
        this.run = run;
        $('review-run').value = run.number;
        this.inputs.image.max = run.images;
        show($('review-dsa'), /dsa/i.test(run.mode));
        this.#show();
    }
    #stop() {
        this.plays = false;
    }
    #step(by, loops = false) {
        if (!this.run) return;
        if (!loops) this.#stop();
        const {images} = this.run;
        this.inputs.image.value = (Number(this.inputs.image.value) - 1 + by + images) % images + 1;
        this.#show();
    }

    #show() {
        if (!this.run) return;
        const value = Object.fromEntries(Object.entries(this.inputs).map(([name, input]) => [name, Number(input.value)]));
        for (const [name, input] of Object.entries(this.inputs)) {
            const words = name === 'image' ? `${value.image} of ${this.run.images}` : name === 'x' || name === 'y' ? value[name].toFixed(2) : input.value;
            input.parentElement.querySelector('output').textContent = words;
        }
        $('review-play').textContent = this.plays ? 'Stop' : 'Play';
        $('review-mask-words').textContent = `mask ${this.mask + 1}`;
        $('review-words').textContent = `${this.run.mode} ${this.run.number}: image ${value.image} of ${this.run.images}`;
        this.left = Math.max(0, Math.min(1 - 1 / value.zoom, this.left));
        this.top = Math.max(0, Math.min(1 - 1 / value.zoom, this.top));
        this.canvas.style.transform = `scale(${value.zoom}) translate(${-100 * this.left}%, ${-100 * this.top}%)`;
        this.wanted = {run: this.run.number, image: value.image - 1, mask: this.mask, shiftX: value.x, shiftY: value.y, window: value.window, level: value.level};
        this.#ask();
    }
    /** One at a time, and what was wanted last. */
    async #ask() {
        const words = JSON.stringify(this.wanted);
        if (this.asking || words === this.shown) return;
        this.asking = true;
        try {
            drawGrey(this.canvas, await this.engine.look(this.wanted));
            this.shown = words;
        } catch (error) {
            $('review-words').textContent = error.message;
            this.wanted = null;
        }
        this.asking = false;
        if (this.wanted && JSON.stringify(this.wanted) !== this.shown) this.#ask();
    }

    #bindDrag() {
        const stage = $('review-stage');
        let from = null;
        stage.addEventListener('pointerdown', (event) => {
            stage.setPointerCapture(event.pointerId);
            from = [event.clientX, event.clientY];
        });
        stage.addEventListener('pointermove', (event) => {
            if (!from) return;
            const side = this.canvas.offsetWidth * Number(this.inputs.zoom.value);
            this.left -= (event.clientX - from[0]) / side;
            this.top -= (event.clientY - from[1]) / side;
            from = [event.clientX, event.clientY];
            this.#show();
        });
        for (const name of ['pointerup', 'pointercancel']) stage.addEventListener(name, () => from = null);
        stage.addEventListener('wheel', (event) => {
            event.preventDefault();
            this.inputs.zoom.value = Number(this.inputs.zoom.value) * (event.deltaY < 0 ? 1.25 : 0.8);
            this.#show();
        }, {passive: false});
    }
}
