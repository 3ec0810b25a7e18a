// The engine, which runs in a worker. Questions that have one answer each are asked one after the other.

import {inFolder, loadScript} from './dom.js';

/** A page that was opened as a file has no worker but of a text, and no files but scripts. */
async function makeWorker() {
    if (!inFolder) return new Worker('worker.js');
    await loadScript('worker.js');
    return new Worker(URL.createObjectURL(new Blob([`(${window.seldingerWorker})()`], {type: 'text/javascript'})));
}

let taken = null;  // of the script that runs
window.seldingerFile = (path, size, text) => taken = {size, text};
async function fileOf(path) {
    try {
        await loadScript(path);
        return taken ?? {error: `${path}: expected a file of Seldinger, found something else`};
    } catch (error) {
        return {error: error.message};
    } finally {
        taken = null;
    }
}

const isLook = (message) => message.do === 'look' || message.do === 'measure';

export class Engine {
    #worker = null;
    #waiting = [];  // for the worker
    #hear;
    #questions = [];
    #asked = null;

    constructor(hear) {
        this.#hear = hear;
        makeWorker().then((worker) => {
            this.#worker = worker;
            worker.onmessage = ({data}) => this.#receive(data);
            worker.onerror = (event) => this.#fail(`The engine stopped: ${event.message || 'worker.js could not be loaded'}.`);
            for (const [message, transfer] of this.#waiting) this.send(message, transfer);
        }, (error) => this.#fail(error.message));
    }
    #fail(error) {
        const failed = {is: 'failed', error};
        if (this.#asked) this.#receive(failed);
        this.#hear(failed);
    }

    send(message, transfer = []) {
        if (this.#worker) this.#worker.postMessage(message, transfer);
        else this.#waiting.push([message, transfer]);
    }

    look(look) {
        return this.#ask('picture', {do: 'look', mask: 0, shiftX: 0, shiftY: 0, window: 256, level: 128, ...look});
    }
    /** What a ruler on the image looked at last measures: {length, scale, found, calibrated}. */
    measure(wanted) {
        return this.#ask('measured', {do: 'measure', ...wanted});
    }
    /** What recordings name: [{exercise, patient, learner} or {error}, …]. */
    async about(recordings) {
        return (await this.#ask('about', {do: 'about', recordings})).all;
    }
    async debrief(recording, name) {
        return (await this.#ask('debriefing', {do: 'debrief', recording, name})).html;
    }
    async course(recordings) {
        return (await this.#ask('course', {do: 'course', recordings})).html;
    }

    /** Pictures of runs are forgotten with their exercise. */
    forgetLooks() {
        const dropped = this.#questions.filter(({message}) => isLook(message));
        this.#questions = this.#questions.filter(({message}) => !isLook(message));
        if (this.#asked && isLook(this.#asked.message)) dropped.push(this.#asked);
        if (dropped.includes(this.#asked)) this.#asked = null;
        for (const {refuse} of dropped) refuse(new Error('The exercise was left.'));
        this.#next();
    }

    #ask(answer, message) {
        return new Promise((resolve, refuse) => {
            this.#questions.push({answer, message, resolve, refuse});
            this.#next();
        });
    }
    #next() {
        if (this.#asked || !this.#questions.length) return;
        this.#asked = this.#questions.shift();
        this.send(this.#asked.message);
    }
    async #receive(data) {
        if (data.is === 'want') return this.send({do: 'file', path: data.path, ...await fileOf(data.path)});
        const asked = this.#asked, isOld = data.is === 'picture' || data.is === 'measured';
        const failed = data.is === 'failed' && asked && !isLook(asked.message);
        const isAnswer = failed || data.is === asked?.answer && (!isOld || data.run === asked.message.run);
        if (!isAnswer) return isOld ? undefined : this.#hear(data);
        this.#asked = null;
        if (data.is === 'failed' || data.error) asked.refuse(new Error(data.error));
        else asked.resolve(data);
        this.#next();
    }
}
