// The readout column: pictograms of the arm, the engine's groups of texts, the devices and the force on the wall.

import {el, say, sharp, show} from './dom.js';

export const ink = {
    ground: '#0e1215', well: '#070a0c', rule: '#262e34', faint: '#566169', body: '#46525a', label: '#86939c',
    value: '#d6dde2', bright: '#f0f3f5', calm: '#5896a8', good: '#5cb878', caution: '#e8b23e', alarm: '#e85648',
    beam: '#f6cc3e'
};

const turn = Math.PI / 180;

/** 'RAO 30°' → −30 where `words` are ['LAO', 'RAO']; 0 where there is no such text. */
export function angleIn(text, [positive, negative]) {
    const found = new RegExp(`(${positive}|${negative})\\w*\\s*(\\d+(?:\\.\\d+)?)`, 'i').exec(text ?? '');
    return found ? (found[1].toUpperCase() === positive ? 1 : -1) * Number(found[2]) : 0;
}

/** A length [cm] among the panel's rows, by the row's name. */
export function centimetresIn(groups, name) {
    for (const {rows} of groups ?? [])
        for (const [label, value] of rows)
            for (const text of [`${label} ${value}`, value]) {
                const found = new RegExp(`(?:^|\\s)${name}\\s+(\\d+(?:\\.\\d+)?)\\s*cm`).exec(text);
                if (found) return Number(found[1]);
            }
    return null;
}

function drawArm(canvas, fromFeet, degrees, lift, beamOn) {
    const {context: c, width, height} = sharp(canvas);
    if (!width) return;
    const unit = Math.min(width / 112, height / 102), tilt = (fromFeet ? degrees : -degrees) * turn;
    c.translate(width / 2, height / 2 - unit);
    c.scale(unit, unit);
    const box = (x0, y0, x1, y1, colour, radius = 0) => {
        c.fillStyle = colour;
        c.beginPath();
        c.roundRect(x0, y0, x1 - x0, y1 - y0, radius);
        c.fill();
    };
    const disc = (x, y, a, b = a) => {
        c.fillStyle = ink.body;
        c.beginPath();
        c.ellipse(x, y, a, b, 0, 0, 7);
        c.fill();
    };
    if (fromFeet) {
        disc(-18.5, 2, 3.5);
        disc(18.5, 2, 3.5);
        disc(0, 0, 15, 8.5);
        box(-23, 9, 23, 11, ink.faint);
    } else {
        disc(-31, 1.5, 6);
        box(-24, -6, 20, 8, ink.body, 6);
        box(10, -2, 50, 8, ink.body, 4);
        box(-40, 9, 50, 11, ink.faint);
    }
    c.rotate(tilt);
    const face = 40 * lift;
    c.fillStyle = beamOn ? 'rgb(246 204 62 / 41%)' : 'rgb(134 147 156 / 15%)';
    c.beginPath();
    c.moveTo(0, 40);
    c.lineTo(-11, -face);
    c.lineTo(11, -face);
    c.fill();
    c.strokeStyle = ink.label;
    c.lineWidth = 3.5;
    c.beginPath();
    c.arc(0, 0, 42, Math.PI / 2, Math.PI * 1.5);
    c.stroke();
    c.beginPath();
    c.moveTo(0, -42);
    c.lineTo(0, -face - 3);
    c.stroke();
    box(-11, -face - 5, 11, -face, ink.value);
    box(-5.5, 38, 5.5, 46, beamOn ? ink.beam : ink.value);
}

/** Values from left to right, broken where one is missing; beyond the scale they stay at its ends. */
function drawCurve(c, {left, top, width, height}, {values, low, high}, colour) {
    c.strokeStyle = colour;
    c.lineWidth = 1.5;
    c.beginPath();
    let down = false;
    values.forEach((value, k) => {
        if (!Number.isFinite(value)) return void (down = false);
        const x = left + 2 + k / Math.max(1, values.length - 1) * (width - 4);
        const part = high > low ? Math.min(1, Math.max(0, (value - low) / (high - low))) : 0;
        const y = top + height - 3 - part * (height - 6);
        down ? c.lineTo(x, y) : c.moveTo(x, y);
        down = true;
    });
    c.stroke();
}

const levelInk = (fraction) => fraction >= 1 ? ink.alarm : fraction >= 0.5 ? ink.caution : ink.calm;

export class Panel {
    /** `drag(axis, radians)`: of a pictogram, axis 'armLao' or 'armCranial'. */
    constructor(column, drag) {
        this.column = column;
        this.arms = ['armLao', 'armCranial'].map((axis, k) => {
            const canvas = el('canvas', {class: 'arm', 'aria-hidden': 'true', title: 'Drag sideways to turn the C-arm'});
            let x = null;
            canvas.addEventListener('pointerdown', (event) => {
                canvas.setPointerCapture(event.pointerId);
                x = event.clientX;
            });
            canvas.addEventListener('pointermove', (event) => {
                if (x === null) return;
                drag(axis, (k ? -1 : 1) * 0.5 * turn * (event.clientX - x));
                x = event.clientX;
            });
            for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, () => x = null);
            return canvas;
        });
        this.trace = el('canvas', {class: 'trace', 'aria-hidden': 'true'});
        this.curves = el('canvas', {class: 'trace curves', 'aria-hidden': 'true', title: 'Electrocardiogram and pressure of the last seconds'});
    }

    #build(readout, shape) {
        this.shape = shape;
        const row = (name) => {
            const value = el('dd');
            return [el('div', {class: 'row-of-two'}, el('dt', {text: name}), value), value];
        };
        const groups = readout.groups.map(({title, rows}) => {
            const made = rows.map(([name]) => row(name));
            const isArm = /c-arm/i.test(title), isPressure = /pressure/i.test(title);
            const section = el('section', {}, el('h2', {text: title}),
                ...(isArm ? [el('div', {class: 'arms'}, ...this.arms)] : []),
                el('dl', {}, ...made.map(([line]) => line)), ...(isPressure ? [this.curves] : []));
            return {section, title, values: made.map(([, value]) => value)};
        });
        this.groups = groups.map(({values}) => values);
        this.deviceValues = readout.devices.map(({name}) => {
            const made = ['Inserted', 'Twist', 'Torque', 'Push'].map(row), heading = el('h2', {text: name});
            return {name, section: el('section', {class: 'device'}, heading, el('dl', {}, ...made.map(([line]) => line))),
                rows: made.map(([line]) => line), values: made.map(([, value]) => value)};
        });
        this.bars = ['Tip force', 'Wall, max.'].map((name) => {
            const bar = el('i'), value = el('dd');
            return {bar, value, line: el('div', {class: 'row-of-two with-bar'}, el('dt', {text: name}), el('span', {class: 'bar'}, bar), value)};
        });
        const force = el('section', {}, el('h2', {text: 'Force'}), el('dl', {}, ...this.bars.map(({line}) => line)), this.trace);
        this.balloon = readout.balloon ? this.#balloonOf(readout.balloon, row) : null;
        const middle = [...this.deviceValues.map(({section}) => section), force, ...(this.balloon ? [this.balloon.section] : [])];
        const contrast = groups.findIndex(({title}) => /contrast/i.test(title));
        const at = contrast < 0 ? groups.length : contrast, sections = groups.map(({section}) => section);
        this.column.replaceChildren(...sections.slice(0, at), ...middle, ...sections.slice(at));
    }

    draw(readout, marks) {
        const shape = JSON.stringify([readout.groups.map(({title, rows}) => [title, rows.map(([name]) => name)]),
            readout.devices.map(({name}) => name), readout.balloon && [readout.balloon.title, readout.balloon.rows.map(([name]) => name)]]);
        if (shape !== this.shape) this.#build(readout, shape);
        readout.groups.forEach(({rows}, k) => rows.forEach(([, value], j) => say(this.groups[k][j], value)));
        const held = readout.held || readout.leftHand;
        readout.devices.forEach((device, k) => {
            const {section, rows, values} = this.deviceValues[k];
            const isHeld = held === 'all' || device.name === held || readout.devices.length === 1;
            section.classList.toggle('held', isHeld);
            [device.inserted, device.twist, device.torque, device.push].forEach((text, j) => {
                say(values[j], text ?? '');
                show(rows[j], (j === 0 || isHeld) && text !== undefined);
            });
        });
        const {force} = readout;
        if (force) {
            [force.tip, force.wall].forEach((value, k) => {
                const fraction = force.limit > 0 && value != null ? value / force.limit : 0, {bar, value: words} = this.bars[k];
                bar.style.transform = `scaleX(${Math.min(1, fraction)})`;
                bar.style.background = levelInk(fraction);
                words.style.color = fraction >= 0.5 ? levelInk(fraction) : '';
                say(words, value == null ? '--' : `${value.toFixed(2)} N`);
            });
            const {context, width, height} = sharp(this.trace);
            drawCurve(context, {left: 0, top: 0, width, height}, {values: force.history ?? [], low: 0, high: force.limit}, ink.calm);
        }
        if (this.balloon) this.#drawBalloon(readout.balloon);
        if (readout.curves) {
            const {context, width, height} = sharp(this.curves), split = 0.3 * height;
            drawCurve(context, {left: 0, top: 0, width, height: split}, readout.curves.ecg, ink.good);
            drawCurve(context, {left: 0, top: split, width, height: height - split}, readout.curves.pressure, ink.alarm);
        }
        const text = marks?.angles ?? '', sid = centimetresIn(readout.groups, 'SID'), sod = centimetresIn(readout.groups, 'SOD');
        const angles = [angleIn(text, ['LAO', 'RAO']), angleIn(text, ['CRAN', 'CAUD'])];
        const drawn = JSON.stringify([angles, sid, sod, readout.beamOn, this.arms[0].clientWidth]);
        if (drawn === this.drawn) return;
        this.drawn = drawn;
        const lift = Math.max(0.3, Math.min(0.85, sid && sod ? (sid - sod) / sod : 0.5));
        this.arms.forEach((canvas, k) => drawArm(canvas, k === 0, angles[k], lift, readout.beamOn));
    }

    #balloonOf({title, rows, fraction}, row) {
        const made = rows.map(([name]) => row(name)), bar = el('i'), device = el('p', {class: 'faint'});
        const track = fraction == null ? [] : [el('span', {class: 'bar'}, bar)];
        return {bar, device, section: el('section', {class: 'balloon'}, el('h2', {text: title}), device, ...track, el('dl', {}, ...made.map(([line]) => line))),
            values: made.map(([, value]) => value)};
    }
    /** Amber beyond the nominal pressure, red beyond the rated one, at which the bar is full. */
    #drawBalloon({device, rows, fraction, nominal, burst}) {
        const {bar, values} = this.balloon, isBeyond = burst || fraction > 1;
        say(this.balloon.device, device);
        rows.forEach(([, value], k) => say(values[k], value));
        bar.style.transform = `scaleX(${Math.min(1, fraction ?? 0)})`;
        bar.style.background = isBeyond ? ink.alarm : fraction > nominal + 0.07 ? ink.caution : ink.calm;
        if (fraction != null) values[0].style.color = isBeyond ? ink.alarm : '';
    }
}
