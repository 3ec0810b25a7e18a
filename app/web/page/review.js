// The runs taken: as a loop at the rate they were taken at, mask, shift, window and level, a ruler; and a zoom, which the
// page does itself.

import {$, drawGrey, el, openDialog, say, show} from './dom.js';

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
            if (this.run) this.time = (Number(this.inputs.image.value) - 1) / this.run.rate;
            this.#show();
        });
        $('review-before').addEventListener('click', () => this.#step(-1));
        $('review-after').addEventListener('click', () => this.#step(1));
        $('review-mask').addEventListener('click', () => {
            this.mask = Number(this.inputs.image.value) - 1;
            this.#show();
        });
        $('review-rules').addEventListener('change', () => this.#rulerIs());
        $('ruler-wire').addEventListener('click', () => this.#measure({calibrate: true}));
        $('ruler-isocentre').addEventListener('click', () => this.#measure({isocentre: true}));
        this.#bindDrag();
        this.#bindRuler();
    }

    reset() {
        Object.assign(this, {runs: [], run: null, mask: 0, plays: true, time: 0, left: 0, top: 0, shown: '', ruler: null, end: 1});
        for (const [name, value] of Object.entries({x: 0, y: 0, window: 256, level: 128, zoom: 1})) this.inputs[name].value = value;
        $('review-rules').checked = false;
        this.#rulerIs();
    }

    /** At an image, which stands then, or from the run's beginning. */
    open(runs, number, image) {
        this.runsAre(runs, true);
        if (runs.length) this.#choose(number ?? this.run?.number ?? runs.at(-1).number);
        if (image !== undefined && this.run) {
            this.#stop();
            this.inputs.image.value = image + 1;
            this.#show();
        }
        openDialog($('review'));
        $('review-play').focus();
        cancelAnimationFrame(this.timer);
        let last = performance.now();
        const turn = (now) => {
            if (!$('review').open) return;
            if (this.plays && this.run?.images > 1) {
                this.time += (now - last) / 1000;
                const at = Math.floor(this.time * this.run.rate) % this.run.images + 1;
                if (at !== Number(this.inputs.image.value)) {
                    this.inputs.image.value = at;
                    this.#show();
                }
            }
            last = now;
            this.timer = requestAnimationFrame(turn);
        };
        this.timer = requestAnimationFrame(turn);
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
            this.mask = this.time = 0;
            this.inputs.image.value = 1;
        }
        this.run = run;
        $('review-run').value = run.number;
        this.inputs.image.max = run.images;
        show($('review-dsa'), run.dsa);
        say($('review-rate'), `${run.rate} images a second, as taken`);
        this.#show();
    }
    #stop() {
        this.plays = false;
    }
    #step(by) {
        if (!this.run) return;
        this.#stop();
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
        $('ruler').style.transform = this.canvas.style.transform = `scale(${value.zoom}) translate(${-100 * this.left}%, ${-100 * this.top}%)`;
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
            this.#drawRuler();
        } catch (error) {
            $('review-words').textContent = error.message;
            this.wanted = null;
        }
        this.asking = false;
        if (this.wanted && JSON.stringify(this.wanted) !== this.shown) this.#ask();
    }

    // ---- The ruler, in pixels of the image: [x0, y0, x1, y1]

    #rulerIs() {
        const is = $('review-rules').checked, stage = $('review-stage');
        show($('review-ruler'), is);
        show($('ruler-words'), is);
        stage.classList.toggle('rules', is);
        if (is) stage.setAttribute('tabindex', '0');
        else stage.removeAttribute('tabindex');
        if (!is) this.ruler = null;
        else if (!this.ruler) {
            const {width, height} = this.canvas;
            this.ruler = [0.4 * width, height / 2, 0.6 * width, height / 2];
        }
        this.#drawRuler();
        if (is) this.#measure();
    }
    #drawRuler() {
        const {width, height} = this.canvas, [x0, y0, x1, y1] = this.ruler ?? [0, 0, 0, 0], svg = $('ruler');
        svg.toggleAttribute('hidden', !this.ruler);
        svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
        const [line, ...ends] = svg.children;
        for (const [name, value] of Object.entries({x1: x0, y1: y0, x2: x1, y2: y1})) line.setAttribute(name, value);
        ends.forEach((end, k) => {
            const x = k ? x1 : x0, y = k ? y1 : y0;
            end.setAttribute('d', `M${x} ${y}h0`);
            end.classList.toggle('moved', k === this.end);
        });
    }
    /** One question at a time, and then about what was asked last. */
    async #measure(more = {}) {
        if (!this.ruler || !this.run) return;
        this.measured = {...this.wanted, ...more, run: this.run.number, ruler: this.ruler};
        if (this.measures) return;
        this.measures = true;
        while (this.measured) {
            const asked = this.measured;
            this.measured = null;
            try {
                const {length, scale, found, calibrated} = await this.engine.measure(asked);
                say($('ruler-length'), length);
                say($('ruler-words'), length);
                say($('ruler-scale'), scale);
                say($('ruler-found'), found);
                show($('ruler-isocentre'), calibrated);
            } catch (error) {
                say($('ruler-length'), error.message);
            }
        }
        this.measures = false;
    }
    #setEnd(x, y) {
        const {width, height} = this.canvas, within = (value, most) => Math.max(0, Math.min(most, value));
        this.ruler[2 * this.end] = within(x, width);
        this.ruler[2 * this.end + 1] = within(y, height);
        this.#drawRuler();
        this.#measure();
    }
    #bindRuler() {
        const stage = $('review-stage');
        const place = ({clientX, clientY}) => {
            const box = this.canvas.getBoundingClientRect();
            return [(clientX - box.left) / box.width * this.canvas.width, (clientY - box.top) / box.height * this.canvas.height];
        };
        let draws = false;
        stage.addEventListener('pointerdown', (event) => {
            if (!this.ruler || event.button) return;
            draws = true;
            this.end = 0;
            this.#setEnd(...place(event));
            this.end = 1;
            this.#setEnd(...place(event));
        });
        stage.addEventListener('pointermove', (event) => draws && this.#setEnd(...place(event)));
        for (const name of ['pointerup', 'pointercancel']) stage.addEventListener(name, () => draws = false);
        const ways = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
        stage.addEventListener('keydown', (event) => {
            if (!this.ruler || event.ctrlKey || event.metaKey || event.altKey) return;
            const way = ways[event.key], step = event.shiftKey ? 10 : 1;
            if (!way && event.key !== ' ') return;
            event.preventDefault();
            if (way) return this.#setEnd(this.ruler[2 * this.end] + step * way[0], this.ruler[2 * this.end + 1] + step * way[1]);
            this.end = 1 - this.end;
            this.#drawRuler();
        });
    }

    #bindDrag() {
        const stage = $('review-stage');
        let from = null;
        stage.addEventListener('pointerdown', (event) => {
            stage.setPointerCapture(event.pointerId);
            if (!this.ruler) from = [event.clientX, event.clientY];
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
