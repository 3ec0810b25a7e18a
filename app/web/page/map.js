// The map of the briefing, as the engine gives it: vessels, the way, start and target [mm].

import {sharp} from './dom.js';
import {ink} from './panel.js';

const rim = '#78808a', vessel = '#3a444c';

export function drawMap(canvas, map) {
    const {context: c, width, height} = sharp(canvas);
    if (!map || !width) return;
    const [left, top] = map.low, [right, bottom] = map.high, unit = Math.max(1, Math.min(width, height) / 330);
    const scale = Math.min(width / (right - left), height / (bottom - top));
    const at = ([x, y]) => [width / 2 + (x - (left + right) / 2) * scale, height / 2 + (y - (top + bottom) / 2) * scale];
    c.fillStyle = ink.well;
    c.fillRect(0, 0, width, height);
    c.lineCap = c.lineJoin = 'round';
    for (const edge of [1, 0]) {
        c.strokeStyle = edge ? rim : vessel;
        for (const {points, radii} of map.vessels)
            for (let k = 1; k < points.length; ++k) {
                c.lineWidth = Math.max(1, (radii[k - 1] + radii[k]) * scale) + 2 * edge;
                c.beginPath();
                c.moveTo(...at(points[k - 1]));
                c.lineTo(...at(points[k]));
                c.stroke();
            }
    }
    c.lineCap = 'butt';
    c.strokeStyle = c.fillStyle = ink.beam;
    c.lineWidth = 2.2 * unit;
    c.setLineDash([map.dash * unit, map.gap * unit]);
    c.beginPath();
    for (const point of map.way) c.lineTo(...at(point));
    c.stroke();
    c.setLineDash([]);
    const start = at(map.start), target = at(map.target), ring = Math.max(7 * unit, map.radius * scale);
    c.beginPath();
    c.arc(...start, 4 * unit, 0, 7);
    c.fill();
    c.strokeStyle = ink.good;
    c.lineWidth = 2.5 * unit;
    c.beginPath();
    c.arc(...target, ring, 0, 7);
    c.stroke();
    c.lineWidth = 1.5 * unit;
    c.beginPath();
    for (const [x, y] of [[4, 0], [0, 4]]) {
        c.moveTo(target[0] - x * unit, target[1] - y * unit);
        c.lineTo(target[0] + x * unit, target[1] + y * unit);
    }
    c.stroke();
    c.font = `${13 * unit}px ${getComputedStyle(canvas).fontFamily}`;
    c.textBaseline = 'middle';
    for (const [words, [x, y], colour] of [['target', [target[0] + ring + 3 * unit, target[1]], ink.good], ['start', [start[0] + 9 * unit, start[1]], ink.beam]]) {
        const wide = c.measureText(words).width, high = 16 * unit;
        const from = Math.max(4, Math.min(width - wide - 4, x)), middle = Math.max(high / 2 + 2, Math.min(height - high / 2 - 2, y));
        c.fillStyle = 'rgb(7 10 12 / 75%)';
        c.fillRect(from - 2, middle - high / 2, wide + 4, high);
        c.fillStyle = colour;
        c.fillText(words, from, middle);
    }
}
