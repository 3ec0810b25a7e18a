// The view into the patient: vessels, devices coloured by the wall's force, and the target, in 3D. The engine gives meshes
// and shaders; the eye is moved here.

import {$, say, show} from './dom.js';

/** A product of matrices of four columns. */
const product = (a, b) => Float32Array.from({length: 16}, (_, k) =>
    [0, 1, 2, 3].reduce((sum, j) => sum + a[4 * j + k % 4] * b[4 * (k >> 2) + j], 0));
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((one) => one / Math.hypot(...a));

function perspective(field, aspect, near, far) {
    const f = 1 / Math.tan(field / 2);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}
function looking(from, to) {
    const back = unit(from.map((one, k) => one - to[k])), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    return [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
        -dot(right, from), -dot(up, from), -dot(back, from), 1];
}

export class Inside {
    constructor() {
        this.canvas = $('inside-view');
        this.meshes = new Map();
        this.#bind();
        new ResizeObserver(() => this.#soon()).observe(this.canvas);
    }
    get isOpen() {
        return !$('inside').hidden;
    }
    open() {
        this.#forget();
        show($('inside'));
        $('room').classList.add('looks-inside');
        $('open-inside').setAttribute('aria-pressed', 'true');
    }
    close() {
        show($('inside'), false);
        $('room').classList.remove('looks-inside');
        $('open-inside')?.setAttribute('aria-pressed', 'false');
    }

    #forget() {
        this.eye = null;
        const {gl} = this;
        for (const {array, vertices, indices} of this.meshes.values()) {
            gl.deleteVertexArray(array);
            gl.deleteBuffer(vertices);
            gl.deleteBuffer(indices);
        }
        this.meshes.clear();
    }

    hear(told) {
        if (!this.isOpen) return;
        if (told.eye) {
            this.eye = told.eye;
            if (!this.#begin(told.shaders)) return;
            const shades = told.shades.map((shade) => `rgb(${shade.join(' ')})`);
            $('inside-scale').style.background = `linear-gradient(to right, ${shades.join(', ')})`;
            say($('inside-legend'), told.legend);
        }
        if (!this.eye || !this.gl) return;
        this.centre = told.centre;
        this.shift = told.shift;
        for (const mesh of told.meshes) this.#send(mesh);
        this.#soon();
    }

    #begin(shaders) {
        if (this.gl) return true;
        const gl = this.canvas.getContext('webgl2', {alpha: false, antialias: true});
        if (!gl) {
            say($('inside-legend'), 'This browser has no WebGL 2 for it.');
            return false;
        }
        this.program = gl.createProgram();
        shaders.forEach((text, k) => {
            const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
            gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${text}`);
            gl.compileShader(shader);
            gl.attachShader(this.program, shader);
        });
        gl.linkProgram(this.program);
        if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
            say($('inside-legend'), 'This browser’s WebGL refuses the view.');
            return false;
        }
        this.at = Object.fromEntries(['camera', 'eye', 'opacity', 'rim', 'shift'].map((name) => [name, gl.getUniformLocation(this.program, name)]));
        this.gl = gl;
        return true;
    }

    #send({name, vertices, indices, lines, opacity, rim}) {
        const {gl} = this;
        let mesh = this.meshes.get(name);
        if (!mesh) {
            mesh = {array: gl.createVertexArray(), vertices: gl.createBuffer(), indices: gl.createBuffer()};
            this.meshes.set(name, mesh);
            gl.bindVertexArray(mesh.array);
            gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
            gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
            for (let k = 0; k < 3; ++k) {
                gl.enableVertexAttribArray(k);
                gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 36, 12 * k);
            }
        }
        Object.assign(mesh, {shape: lines ? gl.LINES : gl.TRIANGLES, opacity, rim, count: indices.length});
        gl.bindVertexArray(mesh.array);
        gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
        gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.DYNAMIC_DRAW);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.DYNAMIC_DRAW);
        gl.bindVertexArray(null);
    }

    #soon() {
        if (this.waits || !this.isOpen || !this.eye) return;
        this.waits = true;
        requestAnimationFrame(() => {
            this.waits = false;
            if (this.isOpen && this.eye && this.gl) this.#draw();
        });
    }
    #draw() {
        const {gl, canvas, at, eye} = this, dense = window.devicePixelRatio || 1;
        const width = Math.max(16, Math.round(canvas.clientWidth * dense)), height = Math.max(16, Math.round(canvas.clientHeight * dense));
        if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
        const level = Math.cos(eye.elevation);
        const from = [Math.sin(eye.azimuth) * level, -Math.cos(eye.azimuth) * level, Math.sin(eye.elevation)]
            .map((one, k) => this.centre[k] + eye.distance * one);
        gl.viewport(0, 0, width, height);
        gl.clearColor(7 / 255, 10 / 255, 12 / 255, 1);
        gl.depthMask(true);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LEQUAL);
        gl.disable(gl.BLEND);
        gl.disable(gl.CULL_FACE);
        gl.useProgram(this.program);
        gl.uniformMatrix4fv(at.camera, false, product(perspective(eye.field, width / height, eye.distance / 50, eye.distance + 3000), looking(from, this.centre)));
        gl.uniform3fv(at.eye, from);
        gl.uniform3fv(at.shift, this.shift);
        const draw = (name) => {
            const mesh = this.meshes.get(name);
            if (!mesh?.count) return;
            gl.uniform1f(at.opacity, mesh.opacity);
            gl.uniform1f(at.rim, mesh.rim);
            gl.bindVertexArray(mesh.array);
            gl.drawElements(mesh.shape, mesh.count, gl.UNSIGNED_INT, 0);
        };
        draw('devices');
        draw('forces');
        gl.enable(gl.BLEND);
        gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
        gl.depthMask(false);
        draw('target');
        gl.enable(gl.CULL_FACE);
        for (const side of [gl.FRONT, gl.BACK]) {  // back surfaces first
            gl.cullFace(side);
            draw('lumen');
        }
        gl.bindVertexArray(null);
    }

    #turn(right, up) {
        const {eye} = this;
        if (!eye) return;
        eye.azimuth -= right;
        eye.elevation = Math.max(-eye.steepest, Math.min(eye.steepest, eye.elevation + up));
        this.#soon();
    }
    #zoom(factor) {
        const {eye} = this;
        if (!eye) return;
        eye.distance = Math.max(eye.nearest, Math.min(eye.farthest, eye.distance * factor));
        this.#soon();
    }

    #bind() {
        const {canvas} = this, fingers = new Map();
        canvas.addEventListener('pointerdown', (event) => {
            canvas.setPointerCapture(event.pointerId);
            fingers.set(event.pointerId, [event.clientX, event.clientY]);
        });
        const apart = () => {
            const [a, b] = [...fingers.values()];
            return Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
        };
        canvas.addEventListener('pointermove', (event) => {
            const last = fingers.get(event.pointerId);
            if (!last) return;
            const before = fingers.size === 2 ? apart() : 0;
            fingers.set(event.pointerId, [event.clientX, event.clientY]);
            if (before) this.#zoom(before / apart());
            else this.#turn(0.008 * (event.clientX - last[0]), 0.008 * (event.clientY - last[1]));
        });
        for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, ({pointerId}) => fingers.delete(pointerId));
        canvas.addEventListener('wheel', (event) => {
            event.preventDefault();
            this.#zoom(event.deltaY < 0 ? 0.85 : 1.18);
        }, {passive: false});
        const keys = {
            ArrowLeft: () => this.#turn(-0.1, 0), ArrowRight: () => this.#turn(0.1, 0), ArrowUp: () => this.#turn(0, -0.1), ArrowDown: () => this.#turn(0, 0.1),
            Equal: () => this.#zoom(0.85), Minus: () => this.#zoom(1.18), NumpadAdd: () => this.#zoom(0.85), NumpadSubtract: () => this.#zoom(1.18)
        };
        canvas.addEventListener('keydown', (event) => {
            if (!keys[event.code] || event.ctrlKey || event.metaKey) return;
            event.preventDefault();
            event.stopPropagation();  // else it is one of the room's
            keys[event.code]();
        });
    }
}
